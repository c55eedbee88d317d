#include "tests/support/splat_drawing.h"

#include <algorithm>
#include <cmath>

#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/test_devices.h"

namespace degas::test {

std::vector<double> drawing_weights(const Camera& camera) {
  return random_values(int64_t{3} * camera.width * camera.height, 9);
}

Drawn draw(Device& device, const SplatScene& scene, const Camera& camera, const SplatOptions& options) {
  const Splats s = scene.upload(device);
  Tape tape(device);
  SplatWorkspace workspace;
  const SplatImage image = splat(tape, workspace, s, camera, drawing_background, options);
  const std::vector<double> weights = drawing_weights(camera);
  const Tensor weight_image = Tensor::from(device, image.color.shape(), std::span<const double>(weights));
  tape.backward(add(tape, sum(tape, multiply(tape, image.color, weight_image)), mean(tape, image.alpha)));
  Drawn drawn{image.color.to_host<double>(), image.alpha.to_host<double>(), {}};
  const Tensor fields[] = {s.positions, s.rotations, s.log_scales, s.opacities, s.colors};
  for (int f = 0; f < 5; ++f) drawn.gradients[f] = fields[f].gradient().to_host<double>();
  return drawn;
}

bool all_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

bool all_finite(const Drawn& drawn) {
  return all_finite(drawn.color) && all_finite(drawn.alpha) &&
         std::all_of(drawn.gradients.begin(), drawn.gradients.end(), [](const auto& g) { return all_finite(g); });
}

bool all_zero(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return value == 0; });
}

bool is_untouched(const Drawn& drawn) {
  for (size_t i = 0; i < drawn.color.size(); ++i) {
    if (drawn.color[i] != drawing_background[i % 3]) return false;
  }
  return all_zero(drawn.alpha) && std::all_of(drawn.gradients.begin(), drawn.gradients.end(), all_zero);
}

double gradient_difference(const Drawn& a, const Drawn& expected) {
  double worst = 0;
  for (int f = 0; f < 5; ++f) {
    double largest = 1e-30, difference = 0;
    for (size_t i = 0; i < expected.gradients[f].size(); ++i) {
      largest = std::max(largest, std::abs(expected.gradients[f][i]));
      const double of_one = std::abs(a.gradients[f][i] - expected.gradients[f][i]);
      difference = std::max(difference, std::isnan(of_one) ? INFINITY : of_one);
    }
    worst = std::max(worst, difference / largest);
  }
  return worst;
}

}  // namespace degas::test
