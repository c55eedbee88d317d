#include "host/ops/reduction.h"

namespace degas {
namespace {

constexpr int64_t block = 1024;

/// Blocks of blocks until one number is left; the last pass applies the factor.
Tensor reduce(Device& device, const Tensor& input, double factor) {
  Tensor current = input;
  while (true) {
    const int64_t blocks = (current.size() + block - 1) / block;
    const Tensor partial(device, {blocks});
    device.kernel("reduction", "block_sum", {{"BLOCK", block}})
        .launch({static_cast<size_t>(blocks)}, {1}, current, partial, blocks == 1 ? factor : 1.0, current.size());
    if (blocks == 1) return partial;
    current = partial;
  }
}

Tensor scaled_sum(Tape& tape, const char* operation, const Tensor& input, double factor) {
  Device& device = tape.device();
  const Tensor output = reduce(device, input, factor);
  tape.record(operation, {input}, {output}, [=](Tape& tape) {
    tape.accumulate(input, [&](const Tensor& gradient) {
      Device& device = tape.device();
      device.kernel("reduction", "broadcast", {{"BLOCK", block}})
          .launch(device.pointwise_global(gradient.size()), device.pointwise_local(), output.gradient(), gradient,
                  factor, gradient.size());
    });
  });
  return output;
}

}  // namespace

Tensor sum(Tape& tape, const Tensor& input) {
  return scaled_sum(tape, "sum", input, 1.0);
}

Tensor mean(Tape& tape, const Tensor& input) {
  return scaled_sum(tape, "mean", input, 1.0 / static_cast<double>(input.size()));
}

}  // namespace degas
