#include "host/ops/pointwise.h"

namespace degas {
namespace {

template <typename... Arguments>
void launch_pointwise(const char* name, const Tensor& shaped_like, const Arguments&... arguments) {
  Device& device = shaped_like.device();
  const int64_t count = shaped_like.size();
  device.kernel("pointwise", name)
      .launch(device.pointwise_global(count), device.pointwise_local(), arguments..., count);
}

}  // namespace

Tensor add(Tape& tape, const Tensor& a, const Tensor& b) {
  require_equal_sizes("add", a, b);
  const Tensor output(tape.device(), a.shape());
  launch_pointwise("add", output, a, b, output);
  tape.record("add", {a, b}, {output},
              [a = a.without_values(), b = b.without_values(), output = output.without_values()](Tape& tape) {
                tape.accumulate(a, output.gradient());
                tape.accumulate(b, output.gradient());
              });
  return output;
}

Tensor multiply(Tape& tape, const Tensor& a, const Tensor& b) {
  require_equal_sizes("multiply", a, b);
  const Tensor output(tape.device(), a.shape());
  launch_pointwise("multiply", output, a, b, output);
  tape.record("multiply", {a, b}, {output}, [=](Tape& tape) {
    const Tensor gradient = output.gradient();
    tape.accumulate(a, [&](const Tensor& da) { launch_pointwise("multiply", da, gradient, b, da); });
    tape.accumulate(b, [&](const Tensor& db) { launch_pointwise("multiply", db, gradient, a, db); });
  });
  return output;
}

Tensor scale(Tape& tape, const Tensor& input, double factor, double offset) {
  const Tensor output(tape.device(), input.shape());
  launch_pointwise("scale", output, input, output, factor, offset);
  tape.record("scale", {input}, {output}, [=](Tape& tape) {
    tape.accumulate(input, [&](const Tensor& gradient) {
      launch_pointwise("scale", gradient, output.gradient(), gradient, factor, 0.0);
    });
  });
  return output;
}

void scale_in_place(const Tensor& array, const Tensor& factor) {
  launch_pointwise("scale_in_place", array, array, factor);
}

}  // namespace degas
