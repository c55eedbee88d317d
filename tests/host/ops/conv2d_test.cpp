#include "host/ops/conv2d.h"

#include "host/autograd/gradient_check.h"
#include "host/io/npz.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

enum class Bias { None, Tied, Untied };

struct ConvolutionCase {
  int batch, height, width, channels, output_channels, kernel;
  Conv2dOptions options;
  Bias bias;
  double largest_weight = 1;

  int output_size(int size) const { return (size + 2 * options.padding - kernel) / options.stride + 1; }
  Shape input_shape() const { return {batch, height, width, channels}; }
  Shape weight_shape() const {
    return {options.groups, kernel, kernel, channels / options.groups, output_channels / options.groups};
  }
  Shape bias_shape() const {
    if (bias == Bias::Tied) return {output_channels};
    return {output_size(height), output_size(width), output_channels};
  }
};

std::ostream& operator<<(std::ostream& stream, const ConvolutionCase& c) {
  return stream << to_string(c.input_shape()) << " * " << to_string(c.weight_shape()) << " stride " << c.options.stride
                << " padding " << c.options.padding << " slope " << c.options.negative_slope << " bias "
                << static_cast<int>(c.bias);
}

/// The definition, term by term.
std::vector<double> naive(const ConvolutionCase& c, const std::vector<double>& input, const std::vector<double>& weight,
                          const std::vector<double>& bias) {
  const int out_height = c.output_size(c.height), out_width = c.output_size(c.width);
  const int depth = c.channels / c.options.groups, out_depth = c.output_channels / c.options.groups;
  std::vector<double> output;
  for (int n = 0; n < c.batch; ++n) {
    for (int oy = 0; oy < out_height; ++oy) {
      for (int ox = 0; ox < out_width; ++ox) {
        for (int o = 0; o < c.output_channels; ++o) {
          const int group = o / out_depth;
          double sum = 0;
          if (c.bias == Bias::Tied) sum = bias[o];
          if (c.bias == Bias::Untied) sum = bias[(oy * out_width + ox) * c.output_channels + o];
          for (int ky = 0; ky < c.kernel; ++ky) {
            for (int kx = 0; kx < c.kernel; ++kx) {
              const int y = oy * c.options.stride + ky - c.options.padding;
              const int x = ox * c.options.stride + kx - c.options.padding;
              if (y < 0 || y >= c.height || x < 0 || x >= c.width) continue;
              for (int k = 0; k < depth; ++k) {
                sum += input[((n * c.height + y) * c.width + x) * c.channels + group * depth + k] *
                       weight[(((group * c.kernel + ky) * c.kernel + kx) * depth + k) * out_depth + o % out_depth];
              }
            }
          }
          output.push_back(sum > 0 ? sum : sum * c.options.negative_slope);
        }
      }
    }
  }
  return output;
}

}  // namespace

TEST_CASE("conv2d equals the plain loops", "[large]") {
  const auto set = GENERATE(from_range(kernel_sets()));
  const ConvolutionCase c = GENERATE(values<ConvolutionCase>({
      {1, 5, 7, 3, 5, 3, {1, 1, 1, 0.2}, Bias::Untied},
      {2, 6, 5, 16, 32, 3, {1, 1, 1, 1}, Bias::Tied},
      {1, 9, 11, 17, 33, 3, {2, 1, 1, 0.2}, Bias::None},
      {2, 8, 8, 24, 8, 4, {2, 1, 1, 0.2}, Bias::Tied},
      {1, 7, 7, 9, 21, 3, {1, 1, 3, 0.2}, Bias::Untied},
      {2, 4, 4, 48, 96, 1, {1, 0, 3, 1}, Bias::None},
      {1, 13, 10, 4, 64, 5, {1, 2, 1, 0}, Bias::Tied},
      {1, 31, 27, 3, 19, 11, {4, 2, 1, 0}, Bias::Tied},
      {1, 6, 7, 80, 15, 1, {2, 0, 1, 1}, Bias::Untied},
      {1, 3, 2, 162, 16, 1, {1, 0, 1, 1}, Bias::None},
      {1, 1, 1, 1, 1, 3, {1, 1, 1, 1}, Bias::Tied},
      {1, 9, 9, 2, 3, 2, {4, 5, 1, 0.5}, Bias::Untied},
      {1, 23, 40, 40, 24, 3, {1, 0, 1, 0.2}, Bias::Tied},
      // Register blocks of three and four vectors; more weights than pixels.
      {2, 6, 9, 20, 40, 3, {1, 1, 1, 0.2}, Bias::Tied},
      {1, 7, 6, 33, 128, 3, {2, 1, 1, 0.2}, Bias::Untied},
      {1, 12, 11, 5, 192, 3, {1, 1, 1, 1}, Bias::None},
      // Narrow enough for several pixels to a vector.
      {2, 5, 24, 3, 3, 3, {1, 1, 1, 0.2}, Bias::Untied},
      {1, 7, 70, 16, 7, 3, {1, 1, 1, 0.2}, Bias::Tied},
      {2, 6, 48, 3, 8, 3, {2, 1, 1, 0.2}, Bias::Tied},
      {1, 5, 9, 1, 4, 1, {2, 0, 1, 1}, Bias::Tied},
      {1, 9, 48, 2, 1, 5, {3, 4, 1, 0.5}, Bias::Untied},
      // The same within groups, as halves of a vector; lines that end within a block of pixels.
      {2, 5, 38, 24, 24, 3, {1, 1, 3, 0.2}, Bias::Untied},
      {1, 4, 64, 32, 16, 1, {1, 0, 2, 1}, Bias::Tied},
      {2, 6, 37, 10, 32, 3, {1, 1, 2, 0.2}, Bias::Untied},
      {1, 9, 41, 5, 13, 3, {2, 1, 1, 0.2}, Bias::Tied},
      {1, 3, 17, 16, 16, 5, {1, 2, 1, 0.2}, Bias::None},
      // Wide enough for Winograd's filtering: tiles that reach over each border, groups, idle lanes. Sums of so many
      // terms are compared at the size of one, which a network's are.
      {2, 13, 18, 96, 48, 3, {1, 1, 3, 0.2}, Bias::Untied, 0.125},
      {1, 22, 37, 32, 20, 3, {1, 1, 1, 0.2}, Bias::Tied, 0.125},
      {1, 23, 40, 48, 24, 3, {1, 0, 1, 0.2}, Bias::Untied, 0.125},
      {1, 11, 30, 64, 32, 3, {1, 2, 1, 1}, Bias::None, 0.125},
  }));
  INFO("set " << static_cast<int>(set) << ", " << c);
  Device& device = test::device(set);
  Tape tape(device, false);
  const Tensor input = random_tensor(device, c.input_shape(), 1);
  const Tensor weight = random_tensor(device, c.weight_shape(), 2, -c.largest_weight, c.largest_weight);
  const Tensor bias = c.bias == Bias::None ? Tensor() : random_tensor(device, c.bias_shape(), 3);
  const Tensor output = conv2d(tape, input, weight, bias, c.options);
  const std::vector<double> biases = bias.defined() ? bias.to_host<double>() : std::vector<double>();
  CHECK(largest_difference(output.to_host<double>(),
                           naive(c, input.to_host<double>(), weight.to_host<double>(), biases)) < 2e-5);
}

TEST_CASE("conv2d gradients pass finite differences", "[large]") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const ConvolutionCase c = GENERATE(values<ConvolutionCase>({
      {1, 5, 7, 3, 5, 3, {1, 1, 1, 0.2}, Bias::Untied},
      {2, 5, 4, 16, 32, 3, {1, 1, 1, 1}, Bias::Untied},
      {1, 9, 8, 17, 33, 3, {2, 1, 1, 0.2}, Bias::Tied},
      {2, 8, 8, 6, 8, 4, {2, 1, 1, 0.2}, Bias::Tied},
      {2, 7, 7, 9, 21, 3, {1, 1, 3, 0.2}, Bias::Untied},
      {1, 6, 6, 12, 54, 3, {2, 1, 3, 1}, Bias::None},
      {1, 21, 19, 3, 20, 11, {4, 2, 1, 0.3}, Bias::Tied},
      {1, 7, 9, 4, 6, 5, {1, 2, 1, 0.2}, Bias::Tied},
      {1, 6, 7, 20, 15, 1, {2, 0, 1, 1}, Bias::Untied},
      {1, 9, 9, 2, 3, 2, {4, 5, 1, 0.5}, Bias::Untied},
      {1, 4, 4, 40, 36, 1, {1, 0, 1, 1}, Bias::None},
      {1, 3, 5, 64, 24, 1, {2, 0, 1, 1}, Bias::None},
      // Phases without a pixel; a load would reach over several pixels behind the last.
      {1, 1, 1, 4, 3, 3, {2, 1, 1, 0.2}, Bias::Tied},
      {1, 4, 63, 1, 1, 3, {1, 1, 1, 1}, Bias::None},
      // Narrow enough for several pixels to a vector.
      {1, 3, 12, 3, 3, 3, {1, 1, 1, 0.2}, Bias::Untied},
      {2, 6, 12, 3, 8, 3, {2, 1, 1, 0.2}, Bias::Tied},
      {1, 4, 12, 8, 6, 4, {2, 1, 1, 0.2}, Bias::Tied},
      {1, 5, 12, 3, 4, 1, {2, 0, 1, 1}, Bias::Tied},
      {1, 7, 24, 2, 1, 5, {3, 4, 1, 0.5}, Bias::Untied},
      {1, 14, 24, 3, 4, 11, {4, 2, 1, 0.3}, Bias::Tied},
      // The same within groups; input or output channels to a vector; lines that end within a block of pixels.
      {2, 3, 38, 24, 24, 3, {1, 1, 3, 0.2}, Bias::Untied},
      {1, 4, 34, 48, 24, 3, {1, 1, 3, 0.2}, Bias::Untied},
      {2, 3, 36, 24, 48, 3, {1, 1, 3, 0.2}, Bias::Tied},
      {1, 4, 32, 32, 16, 1, {1, 0, 2, 1}, Bias::Tied},
      {1, 7, 35, 14, 9, 3, {2, 1, 1, 0.2}, Bias::Tied},
      {2, 4, 19, 11, 13, 3, {1, 1, 1, 0.2}, Bias::None},
      {1, 2, 1, 16, 16, 3, {1, 1, 1, 0.2}, Bias::None},
      // Wide enough for Winograd's filtering.
      {2, 13, 18, 96, 48, 3, {1, 1, 3, 0.2}, Bias::Untied},
      {1, 14, 21, 32, 32, 3, {1, 0, 1, 0.2}, Bias::Tied},
  }));
  INFO(c);
  std::vector<Tensor> inputs = {random_tensor(device, c.input_shape(), 1), random_tensor(device, c.weight_shape(), 2)};
  if (c.bias != Bias::None) inputs.push_back(random_tensor(device, c.bias_shape(), 3));
  for (Tensor& input : inputs) input.set_requires_gradient();
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{conv2d(tape, in[0], in[1], in.size() > 2 ? in[2] : Tensor(), c.options)};
  };
  CHECK(gradient_check(device, function, inputs) < 1e-6);
}

TEST_CASE("conv2d and its gradients equal PyTorch's") {
  const auto set = GENERATE(from_range(kernel_sets()));
  const std::string name = GENERATE("grouped", "down", "k4s2", "alex", "five", "skip", "wide");
  INFO("set " << static_cast<int>(set) << ", " << name);
  // PyTorch's own float32 is up to 6e-6 away from these double-precision numbers (sums of 800 terms that cancel), and
  // the order of summation differs between devices; a wrong term shows as 1e-2 and more.
  constexpr double bar = 2e-5;
  const NpzFile file(DEGAS_TEST_VECTORS "/conv2d.npz");
  Device& device = test::device(set);
  const auto stored = [&](const char* key) { return file.read(name + "." + key); };
  const auto tensor = [&](const char* key) {
    const NpyArray array = stored(key);
    return Tensor::from(device, array.shape, std::span<const float>(array.floats()));
  };
  const std::vector<double> options = stored("options").doubles();
  const Conv2dOptions conv{static_cast<int>(options[0]), static_cast<int>(options[1]), static_cast<int>(options[2]),
                           options[3]};
  Tensor input = tensor("input").set_requires_gradient(), weight = tensor("weight").set_requires_gradient();
  const bool has_bias = file.contains(name + ".bias");
  Tensor bias = has_bias ? tensor("bias").set_requires_gradient() : Tensor();

  Tape tape(device);
  const Tensor output = conv2d(tape, input, weight, bias, conv);
  CHECK(output.shape() == stored("output").shape);
  CHECK(largest_difference(output.to_host<double>(), stored("output").doubles()) < bar);
  tape.backward(sum(tape, multiply(tape, output, tensor("factor"))));
  CHECK(largest_difference(input.gradient().to_host<double>(), stored("input_gradient").doubles()) < bar);
  CHECK(largest_difference(weight.gradient().to_host<double>(), stored("weight_gradient").doubles()) < bar);
  if (has_bias) CHECK(largest_difference(bias.gradient().to_host<double>(), stored("bias_gradient").doubles()) < bar);
}

TEST_CASE("conv2d repeats to the bit", "[large]") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Tensor input = random_tensor(device, {1, 64, 64, 8}, 1), target = random_tensor(device, {1, 64, 64, 20}, 2);
  Tensor weight = random_tensor(device, {1, 3, 3, 8, 20}, 3).set_requires_gradient();
  Tensor bias = random_tensor(device, {20}, 4).set_requires_gradient();
  std::vector<std::vector<float>> first;
  for (int run = 0; run < 3; ++run) {
    weight.clear_gradient();
    bias.clear_gradient();
    Tape tape(device);
    const Conv2dOptions options = {.padding = 1, .negative_slope = 0.2};
    tape.backward(sum(tape, multiply(tape, conv2d(tape, input, weight, bias, options), target)));
    const std::vector<std::vector<float>> now = {weight.gradient().to_host<float>(), bias.gradient().to_host<float>()};
    if (run == 0) first = now;
    CHECK(now == first);
  }
}

TEST_CASE("conv2d refuses shapes that do not fit") {
  Device& device = test::device(KernelSet::Wide);
  Tape tape(device, false);
  const Tensor input = Tensor::zeros(device, {1, 4, 4, 6}), weight = Tensor::zeros(device, {2, 3, 3, 3, 2});
  CHECK_THROWS_WITH(conv2d(tape, input, weight, Tensor(), {}), Catch::StartsWith("[conv2d] stride, padding, groups"));
  const Conv2dOptions grouped = {.groups = 2};
  CHECK_THROWS_WITH(conv2d(tape, input, weight, Tensor::zeros(device, {3}), grouped),
                    Catch::Contains("bias is neither"));
  CHECK_THROWS_WITH(conv2d(tape, Tensor::zeros(device, {1, 2, 4, 6}), weight, Tensor(), grouped),
                    Catch::Contains("kernel is larger"));
  CHECK(conv2d(tape, input, weight, Tensor(), grouped).shape() == Shape{1, 2, 2, 4});
}

TEST_CASE("kept signs give the bits that the kept output gives", "[large]") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  // Large enough to be packed, and no whole number of words.
  const Tensor input = random_tensor(device, {1, 199, 191, 2}, 1).set_requires_gradient();
  const Tensor weight = random_tensor(device, {1, 3, 3, 2, 7}, 2).set_requires_gradient();
  std::vector<std::vector<float>> gradients[2];
  for (const bool keep_signs : {false, true}) {
    Tape tape(device);
    const Conv2dOptions options{.padding = 1, .negative_slope = 0.2, .keep_signs = keep_signs};
    const Tensor output = conv2d(tape, input, weight, Tensor(), options);
    tape.backward(sum(tape, multiply(tape, output, random_tensor(device, output.shape(), 3))));
    for (Tensor tensor : {input, weight}) {
      gradients[keep_signs].push_back(tensor.gradient().to_host<float>());
      tensor.clear_gradient();
    }
  }
  CHECK(gradients[0] == gradients[1]);
}
