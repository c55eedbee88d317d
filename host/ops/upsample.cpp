#include "host/ops/upsample.h"

#include <fmt/format.h>

#include <numeric>
#include <stdexcept>

namespace degas {
namespace {

/// Rows of the target (N, height, width, C) are made by the kernel from an input of in_height x in_width.
void launch(const char* name, const Tensor& source, const Tensor& target, int64_t in_height, int64_t in_width) {
  Device& device = source.device();
  const int64_t channels = target.dim(3);
  // All powers of two up to V divide V, so this is the widest vector that divides the channels.
  const int64_t vector = std::gcd(channels, int64_t{device.vector_width()});
  const int vectors = static_cast<int>(channels / vector);
  const Kernel kernel = device.kernel("upsample", name, {{"CHANNEL_VECTOR", vector}});
  const size_t images = target.dim(0), height = target.dim(1), width = target.dim(2);
  if (device.is_wide()) {
    kernel.launch({height, images}, {1, 1}, source, target, static_cast<int>(in_height), static_cast<int>(in_width),
                  vectors);
  } else {
    kernel.launch({width * vectors, height, images}, {64, 1, 1}, source, target, static_cast<int>(in_height),
                  static_cast<int>(in_width), vectors);
  }
}

}  // namespace

Tensor upsample(Tape& tape, const Tensor& input) {
  if (input.shape().size() != 4) {
    throw std::logic_error(fmt::format("[upsample] needs (N, H, W, C), got {}", to_string(input.shape())));
  }
  const int64_t height = input.dim(1), width = input.dim(2);
  const Tensor output(tape.device(), {input.dim(0), 2 * height, 2 * width, input.dim(3)});
  launch("upsample_forward", input, output, height, width);
  tape.record("upsample", {input}, {output},
              [=, input = input.without_values(), output = output.without_values()](Tape& tape) {
                tape.accumulate(input, [&](const Tensor& gradient) {
                  launch("upsample_backward", output.gradient(), gradient, height, width);
                });
              });
  return output;
}

}  // namespace degas
