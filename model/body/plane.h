#pragma once

#include <Eigen/Core>

namespace degas {

/// z of the cross product of two vectors of a plane: the area that they span, above 0 where b lies to the left of a.
inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace degas
