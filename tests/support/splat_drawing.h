#pragma once

#include <array>
#include <vector>

#include "tests/support/splat_reference.h"

namespace degas::test {

/// Over which draw() draws: exact in float.
constexpr std::array<double, 3> drawing_background = {0.25, 0.5, 0.75};

/// The rotation that turns nothing.
constexpr std::array<double, 4> upright = {1, 0, 0, 0};

/// What a device made of a scene. Floats are held exactly.
struct Drawn {
  std::vector<double> color, alpha;
  std::array<std::vector<double>, 5> gradients;  ///< in the order of Splats' fields
};

/// The image of weights in [-1, 1) that draw() multiplies colours by.
std::vector<double> drawing_weights(const Camera& camera);

/// The image and the gradients of sum(drawing_weights * color) + mean(alpha).
Drawn draw(Device& device, const SplatScene& scene, const Camera& camera, const SplatOptions& options = {});

bool all_finite(const std::vector<double>& values);
bool all_finite(const Drawn& drawn);
bool all_zero(const std::vector<double>& values);
/// Every pixel is drawing_background bit for bit, alpha zero, and every gradient zero.
bool is_untouched(const Drawn& drawn);

/// Largest difference of a gradient relative to the largest number of its kind; infinity on NaN.
double gradient_difference(const Drawn& a, const Drawn& expected);

}  // namespace degas::test
