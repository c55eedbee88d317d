#pragma once

#include <array>
#include <vector>

#include "host/ops/camera.h"

namespace degas::bench {

/// A splat's numbers: position (3), quaternion w, x, y, z (4), log-scales (3), opacity, colour (3).
constexpr int numbers_of_splat = 14, splats_of_scene = 3;
constexpr int numbers_of_scene = numbers_of_splat * splats_of_scene;
using StressedScene = std::array<double, numbers_of_scene>;

/// What widely used splatters do, beside rounding.
struct TextbookFaults {
  bool ignores_frustum_clamp = false;  ///< the Jacobian's place is clamped, its gradient is not
  bool ignores_alpha_clamp = false;    ///< opacities get a gradient where alpha is clamped
  unsigned sum_order = 0;              ///< above 0: pixels add to the gradients in a random order, as atomics do
};

struct TextbookResult {
  std::vector<double> color;                        ///< (H,W,3)
  std::array<double, numbers_of_scene> gradient{};  ///< of sum(weights * color)
};

/// Splatting as papers write it (Zwicker et al. 2001; Kerbl et al. 2023), over black, with the constants of
/// host/ops/splat.h and a smooth cut-off: world covariance, inverse of the image's covariance by its determinant, all
/// splats in every pixel, derivatives carried forward with every number. Real: float, or double for the reference.
/// weights: (H,W,3).
template <typename Real>
TextbookResult textbook_splats(const StressedScene& scene, const Camera& camera, const std::vector<double>& weights,
                               const TextbookFaults& faults = {});

}  // namespace degas::bench
