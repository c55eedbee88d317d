#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace degas::test {

/// The 15 real spherical harmonics of degrees 1 to 3 at a direction of any length, from associated Legendre functions:
/// Y_l^m = sqrt(2) P_l^m(cos theta) cos(m phi), or sin(|m| phi) for m < 0, with the Condon-Shortley phase.
inline std::array<double, 15> reference_harmonics(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d d = direction.normalized();
  const double theta = std::acos(std::clamp(d.z(), -1.0, 1.0)), phi = std::atan2(d.y(), d.x());
  std::array<double, 15> result{};
  size_t next = 0;
  for (int l = 1; l <= 3; ++l) {
    for (int m = -l; m <= l; ++m) {
      const double legendre = std::sph_legendre(static_cast<unsigned>(l), static_cast<unsigned>(std::abs(m)), theta);
      const double turn = m == 0 ? 1 : std::numbers::sqrt2 * (m > 0 ? std::cos(m * phi) : std::sin(-m * phi));
      result[next++] = legendre * turn;
    }
  }
  return result;
}

}  // namespace degas::test
