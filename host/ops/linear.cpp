#include "host/ops/linear.h"

#include <fmt/format.h>

#include <stdexcept>

namespace degas {
namespace {

struct LinearSizes {
  int batch, inputs, outputs;
};

Kernel linear_kernel(Device& device, const char* name) {
  return device.kernel("linear", name, {{"UNROLL", device.is_wide() ? 4 : 1}});
}

size_t divided(int64_t count, int64_t divisor) {
  return static_cast<size_t>((count + divisor - 1) / divisor);
}

Tensor forward(const Tensor& input, const Tensor& weight, const Tensor& bias, const LinearSizes& s, double slope) {
  Device& device = input.device();
  // Blocks keep an item's stretch of weights within the reach of the prefetcher and give GPUs enough items.
  const int block_size = 64;
  const int blocks = static_cast<int>(divided(s.inputs, block_size));
  const Tensor partial(device, {blocks, s.batch, s.outputs}), output(device, {s.batch, s.outputs});
  const int64_t owned = device.is_wide() ? device.vector_width() * 4 : 1;
  const Range local = device.is_wide() ? Range{1, 1, 1} : Range{64, 1, 1};
  linear_kernel(device, "linear_partial")
      .launch({divided(s.outputs, owned), static_cast<size_t>(blocks), static_cast<size_t>(s.batch)}, local, input,
              weight, partial, s.inputs, s.outputs, block_size, s.batch);
  linear_kernel(device, "linear_finish")
      .launch({static_cast<size_t>(s.batch) * s.outputs}, {64}, partial, bias, output, blocks, s.outputs, s.batch,
              slope);
  return output;
}

/// The gradient before the activation.
Tensor activation_backward(const Tensor& output, const Tensor& gradient, double slope) {
  if (slope == 1) return gradient;
  const Tensor before(output.device(), output.shape());
  linear_kernel(output.device(), "linear_activation_backward")
      .launch({static_cast<size_t>(output.size())}, {64}, output, gradient, before, slope,
              static_cast<int>(output.size()));
  return before;
}

}  // namespace

Tensor linear(Tape& tape, const Tensor& input, const Tensor& weight, const Tensor& bias, double negative_slope) {
  const LinearSizes s{static_cast<int>(input.dim(0)), static_cast<int>(weight.dim(0)), static_cast<int>(weight.dim(1))};
  if (input.size() != int64_t{s.batch} * s.inputs || (bias.defined() && bias.size() != s.outputs)) {
    throw std::logic_error(fmt::format("[linear] input {}, weight {} and bias {} do not fit", to_string(input.shape()),
                                       to_string(weight.shape()), bias.defined() ? to_string(bias.shape()) : "none"));
  }
  const Tensor output = forward(input, weight, bias, s, negative_slope);
  std::vector<Tensor> inputs = {input, weight};
  if (bias.defined()) inputs.push_back(bias);
  tape.record("linear", inputs, {output}, [=](Tape& tape) {
    Device& device = tape.device();
    const bool wide = device.is_wide();
    const Tensor before = activation_backward(output, output.gradient(), negative_slope);
    tape.accumulate(input, [&](const Tensor& gradient) {
      const Range global{static_cast<size_t>(s.inputs) * (wide ? 1 : 64), static_cast<size_t>(s.batch)};
      linear_kernel(device, "linear_input_backward")
          .launch(global, {wide ? size_t{16} : size_t{64}, 1}, weight, before, gradient, s.inputs, s.outputs, s.batch);
    });
    tape.accumulate(weight, [&](const Tensor& gradient) {
      linear_kernel(device, "linear_weight_backward")
          .launch({divided(s.outputs, device.vector_width()), static_cast<size_t>(s.inputs)},
                  wide ? Range{1, 16} : Range{64, 1}, input, before, gradient, s.inputs, s.outputs, s.batch);
    });
    if (!bias.defined()) return;
    tape.accumulate(bias, [&](const Tensor& gradient) {
      linear_kernel(device, "linear_bias_backward")
          .launch({static_cast<size_t>(s.outputs)}, {64}, before, gradient, s.outputs, s.batch);
    });
  });
  return output;
}

}  // namespace degas
