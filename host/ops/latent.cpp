#include "host/ops/latent.h"

namespace degas {
namespace {

template <typename... Arguments>
void launch_latent(const char* name, const Tensor& shaped_like, const Arguments&... arguments) {
  const int count = static_cast<int>(shaped_like.size());
  shaped_like.device().kernel("latent", name).launch({static_cast<size_t>(count)}, {64}, arguments..., count);
}

}  // namespace

Tensor sample_latent(Tape& tape, const Tensor& mean, const Tensor& log_deviation, const Tensor& noise) {
  require_equal_sizes("sample_latent", mean, log_deviation);
  require_equal_sizes("sample_latent", mean, noise);
  const Tensor code(tape.device(), mean.shape());
  launch_latent("sample_latent", code, mean, log_deviation, noise, code);
  tape.record("sample_latent", {mean, log_deviation}, {code}, [=](Tape& tape) {
    const Tensor gradient = code.gradient();
    tape.accumulate(mean, gradient);
    tape.accumulate(log_deviation, [&](const Tensor& target) {
      launch_latent("sample_latent_backward", target, log_deviation, noise, gradient, target);
    });
  });
  return code;
}

Tensor unit_divergence(Tape& tape, const Tensor& mean, const Tensor& log_deviation) {
  require_equal_sizes("unit_divergence", mean, log_deviation);
  const Tensor divergence(tape.device(), mean.shape());
  launch_latent("unit_divergence", divergence, mean, log_deviation, divergence);
  tape.record("unit_divergence", {mean, log_deviation}, {divergence}, [=](Tape& tape) {
    const Tensor gradient = divergence.gradient();
    tape.accumulate(mean, [&](const Tensor& target) {
      Device& device = tape.device();
      device.kernel("pointwise", "multiply")
          .launch(device.pointwise_global(target.size()), device.pointwise_local(), gradient, mean, target,
                  target.size());
    });
    tape.accumulate(log_deviation, [&](const Tensor& target) {
      launch_latent("unit_divergence_backward", target, log_deviation, gradient, target);
    });
  });
  return divergence;
}

}  // namespace degas
