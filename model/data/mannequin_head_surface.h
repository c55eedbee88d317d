#pragma once

#include <Eigen/Core>

namespace degas {

/// Signed distance (first order, metres) of the bald head with neck, ears, lips and lids, in the canonical pose.
double head_distance(const Eigen::Vector3d& position);

Eigen::Vector3d head_center();

/// The head's surface seen from its centre: `around` 0 = front, pi/2 = left; `from_below` 0 = down, pi = up (radians).
Eigen::Vector3d head_surface(double around, double from_below);

}  // namespace degas
