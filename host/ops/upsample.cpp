#include "host/ops/upsample.h"

#include <fmt/format.h>

#include <numeric>
#include <stdexcept>

namespace degas {
namespace {

/// Rows of the target (N, height, width, C) are made by the kernel from an input of in_height x in_width.
template <typename... Arrays>
void launch_upsample(const char* name, int64_t in_height, int64_t in_width, const Tensor& target,
                     const Arrays&... arrays) {
  Device& device = target.device();
  const int64_t channels = target.dim(3);
  // All powers of two up to V divide V, so this is the widest vector that divides the channels.
  const int64_t vector = std::gcd(channels, int64_t{device.vector_width()});
  const int vectors = static_cast<int>(channels / vector);
  const Kernel kernel = device.kernel("upsample", name, {{"CHANNEL_VECTOR", vector}});
  const size_t images = target.dim(0), height = target.dim(1), width = target.dim(2);
  const Range global = device.is_wide() ? Range{height, images} : Range{width * vectors, height, images};
  const Range local = device.is_wide() ? Range{1, 1} : Range{64, 1, 1};
  kernel.launch(global, local, arrays..., target, static_cast<int>(in_height), static_cast<int>(in_width), vectors);
}

/// base + the enlarged input; base may be undefined.
Tensor enlarged(const Tensor& input, const Tensor& base) {
  const Tensor output(input.device(), {input.dim(0), 2 * input.dim(1), 2 * input.dim(2), input.dim(3)});
  launch_upsample("upsample_forward", input.dim(1), input.dim(2), output, input, base);
  return output;
}

void accumulate_enlarged(Tape& tape, const Tensor& input, const Tensor& output_gradient) {
  tape.accumulate(input, [&](const Tensor& gradient) {
    launch_upsample("upsample_backward", input.dim(1), input.dim(2), gradient, output_gradient);
  });
}

}  // namespace

Tensor upsample(Tape& tape, const Tensor& input) {
  if (input.shape().size() != 4) {
    throw std::logic_error(fmt::format("[upsample] needs (N, H, W, C), got {}", to_string(input.shape())));
  }
  Tensor output = enlarged(input, Tensor());
  tape.record("upsample", {input}, {output},
              [input = input.without_values(), output = output.without_values()](Tape& tape) {
                accumulate_enlarged(tape, input, output.gradient());
              });
  if (tape.recording()) output.set_recipe([input] { return enlarged(input, Tensor()); });
  return output;
}

Tensor add_upsampled(Tape& tape, const Tensor& base, const Tensor& input) {
  if (input.shape().size() != 4 ||
      base.shape() != Shape{input.dim(0), 2 * input.dim(1), 2 * input.dim(2), input.dim(3)}) {
    throw std::logic_error(fmt::format("[add_upsampled] {} is not twice the size of {}", to_string(base.shape()),
                                       to_string(input.shape())));
  }
  const Tensor output = enlarged(input, base);
  tape.record(
      "add_upsampled", {base, input}, {output},
      [base = base.without_values(), input = input.without_values(), output = output.without_values()](Tape& tape) {
        accumulate_enlarged(tape, input, output.gradient());
        tape.accumulate(base, output.gradient());
      });
  return output;
}

}  // namespace degas
