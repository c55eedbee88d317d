#include "host/ops/pooling.h"

#include <fmt/format.h>

#include <stdexcept>

namespace degas {
namespace {

Range one_item_per_vector(const Device& device, int64_t pixels, int64_t channels, int64_t* items) {
  const int64_t vector = device.vector_width();
  *items = pixels * ((channels + vector - 1) / vector);
  return {static_cast<size_t>(*items)};
}

}  // namespace

Tensor max_pool(Tape& tape, const Tensor& input, bool ceil_mode, int window) {
  if (window < 2 || window > 3 || input.shape().size() != 4 || input.dim(1) < window || input.dim(2) < window) {
    throw std::logic_error(
        fmt::format("[max_pool] needs a window of 2 or 3 and (N,H,W,C) with sides no smaller, got {} and {}", window,
                    to_string(input.shape())));
  }
  const Defines defines{{"WINDOW", window}};
  Device& device = tape.device();
  const auto pooled = [&](int64_t side) { return (side - window + (ceil_mode ? 1 : 0)) / 2 + 1; };
  const int height = static_cast<int>(input.dim(1)), width = static_cast<int>(input.dim(2));
  const int channels = static_cast<int>(input.dim(3));
  const Tensor output(device, {input.dim(0), pooled(height), pooled(width), channels});
  const int out_height = static_cast<int>(output.dim(1)), out_width = static_cast<int>(output.dim(2));
  Tensor choice;
  if (tape.needs_gradient({input})) choice = Tensor(device, output.shape());
  int64_t items = 0;
  const Range range = one_item_per_vector(device, output.size() / channels, channels, &items);
  device.kernel("pooling", "max_pool", defines)
      .launch(range, device.pointwise_local(), input, output, choice, height, width, channels, out_height, out_width,
              items);
  tape.record("max_pool", {input}, {output}, [=](Tape& tape) {
    tape.accumulate(input, [&](const Tensor& gradient) {
      Device& device = tape.device();
      int64_t items = 0;
      const Range range = one_item_per_vector(device, gradient.size() / channels, channels, &items);
      device.kernel("pooling", "max_pool_gradient", defines)
          .launch(range, device.pointwise_local(), output.gradient(), choice, gradient, height, width, channels,
                  out_height, out_width, items);
    });
  });
  return output;
}

}  // namespace degas
