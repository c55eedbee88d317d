#include "host/ops/conv2d.h"

#include <fmt/format.h>

#include <stdexcept>

#include "host/ops/conv2d_launch.h"
#include "host/ops/sign.h"

namespace degas {
namespace {

[[noreturn]] void refuse(const Tensor& input, const Tensor& weight, const Tensor& bias, const char* reason) {
  throw std::logic_error(fmt::format("[conv2d] {}: input {}, weight {}, bias {}", reason, to_string(input.shape()),
                                     to_string(weight.shape()), bias.defined() ? to_string(bias.shape()) : "none"));
}

Conv2dGeometry geometry_of(const Tensor& input, const Tensor& weight, const Tensor& bias,
                           const Conv2dOptions& options) {
  if (input.shape().size() != 4 || weight.shape().size() != 5 || weight.dim(1) != weight.dim(2)) {
    refuse(input, weight, bias, "needs input (N,H,W,Cin) and weight (groups,K,K,Cin/groups,Cout/groups)");
  }
  if (options.stride < 1 || options.padding < 0 || weight.dim(0) != options.groups ||
      input.dim(3) != weight.dim(3) * options.groups) {
    refuse(input, weight, bias, "stride, padding, groups or channels do not fit");
  }
  Conv2dGeometry g;
  g.batch = static_cast<int>(input.dim(0));
  g.height = static_cast<int>(input.dim(1));
  g.width = static_cast<int>(input.dim(2));
  g.channels = static_cast<int>(input.dim(3));
  g.kernel_size = static_cast<int>(weight.dim(1));
  g.stride = options.stride;
  g.padding = options.padding;
  g.groups = options.groups;
  const int span_y = g.height + 2 * g.padding - g.kernel_size, span_x = g.width + 2 * g.padding - g.kernel_size;
  if (span_y < 0 || span_x < 0) refuse(input, weight, bias, "the kernel is larger than the padded input");
  g.output_height = span_y / g.stride + 1;
  g.output_width = span_x / g.stride + 1;
  g.output_channels = static_cast<int>(weight.dim(4)) * g.groups;
  return g;
}

BiasKind bias_kind(const Conv2dGeometry& g, const Tensor& input, const Tensor& weight, const Tensor& bias) {
  if (!bias.defined()) return BiasKind::None;
  if (bias.shape() == Shape{g.output_channels}) return BiasKind::Tied;
  if (bias.shape() == Shape{g.output_height, g.output_width, g.output_channels}) return BiasKind::Untied;
  refuse(input, weight, bias, "bias is neither (Cout) nor (OutH,OutW,Cout)");
}

}  // namespace

Tensor conv2d(Tape& tape, const Tensor& input, const Tensor& weight, const Tensor& bias, const Conv2dOptions& options) {
  const Conv2dGeometry g = geometry_of(input, weight, bias, options);
  const BiasKind kind = bias_kind(g, input, weight, bias);
  const Tensor output(tape.device(), g.output_shape());
  conv2d_forward(g, input, weight, bias, kind, options.negative_slope, output);

  const double slope = options.negative_slope;
  if (!tape.needs_gradient({input, weight, bias})) return output;
  // The activation's gradient takes the output's signs; nothing else of the output is read again. Packing small ones
  // would be a launch for nothing.
  constexpr size_t worth_packing = 1 << 20;
  const bool packs = slope != 1 && options.keep_signs && output.bytes() > worth_packing;
  const Tensor signs = packs ? pack_signs(output) : Tensor();
  const Tensor kept = slope != 1 && !signs.defined() ? output : output.without_values();
  tape.record("conv2d", {input, weight, bias}, {output}, [=, input = input.kept(), output = kept](Tape& tape) mutable {
    const bool in_place = !output.gradient_is_shared();
    Tensor gradient = output.gradient();
    if (slope != 1) {
      const Tensor pre_activation = in_place ? gradient : Tensor(tape.device(), g.output_shape());
      if (signs.defined()) {
        leaky_relu_gradient(gradient, signs, slope, pre_activation);
      } else {
        conv2d_backward_activation(gradient, output, slope, pre_activation);
      }
      gradient = pre_activation;
    }
    // What is through goes back to the pool before the large gradients to come.
    output.clear_gradient();
    output = Tensor();
    if (kind == BiasKind::Untied && g.batch == 1) {
      tape.accumulate(bias, gradient);  // one and the same
    } else {
      tape.accumulate(bias, [&](const Tensor& target) { conv2d_backward_bias(g, kind, gradient, target); });
    }
    tape.accumulate(weight,
                    [&](const Tensor& target) { conv2d_backward_weight(g, input.rebuilt(), gradient, target); });
    tape.accumulate(input, [&](const Tensor& target) { conv2d_backward_input(g, gradient, weight, target); });
  });
  return output;
}

Tensor conv2d_weight_from_torch(Device& device, const Shape& shape, std::span<const float> values, double factor) {
  if (shape.size() != 4 || shape[2] != shape[3] || element_count(shape) != static_cast<int64_t>(values.size())) {
    throw std::logic_error(fmt::format("[conv2d] torch weight {} with {} numbers", to_string(shape), values.size()));
  }
  const int64_t outputs = shape[0], inputs = shape[1], taps = shape[2] * shape[3];
  std::vector<double> weight(values.size());
  for (int64_t output = 0; output < outputs; ++output) {
    for (int64_t input = 0; input < inputs; ++input) {
      for (int64_t tap = 0; tap < taps; ++tap) {
        weight[(tap * inputs + input) * outputs + output] =
            factor * static_cast<double>(values[(output * inputs + input) * taps + tap]);
      }
    }
  }
  return Tensor::from(device, {1, shape[2], shape[3], inputs, outputs}, std::span<const double>(weight));
}

}  // namespace degas
