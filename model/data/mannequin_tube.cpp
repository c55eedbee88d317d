#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/data/mannequin_parts.h"

namespace degas {
using Eigen::Vector3d;

Eigen::Vector2d superellipse(double angle, double exponent) {
  const double s = std::sin(angle), c = std::cos(angle), power = 2 / exponent;
  return {std::copysign(std::pow(std::abs(s), power), s), std::copysign(std::pow(std::abs(c), power), c)};
}

Vector3d mirrored_side(const Vector3d& left_position, bool left) {
  return left ? left_position : Vector3d(-left_position.x(), left_position.y(), left_position.z());
}

std::vector<std::vector<int>> add_tube(MannequinBuilder& builder, const std::vector<int>& loop,
                                       const std::vector<std::vector<Vector3d>>& ideal,
                                       const std::vector<int>& ring_joints, int blend) {
  std::vector<std::vector<int>> rows{loop};
  Vector3d loop_center = Vector3d::Zero();
  for (const int v : loop) loop_center += builder.mesh.vertices[v] / static_cast<double>(loop.size());
  for (size_t r = 0; r < ideal.size(); ++r) {
    const double own = 1 - smoothstep(0, blend, static_cast<double>(r + 1));
    Vector3d center = Vector3d::Zero();
    for (const auto& p : ideal[r]) center += p / static_cast<double>(ideal[r].size());
    std::vector<int> row;
    for (size_t j = 0; j < loop.size(); ++j) {
      const Vector3d carried = builder.mesh.vertices[loop[j]] - loop_center + center;
      const double fairing = own > 0 ? 0.5 : 0;
      row.push_back(builder.add(own * carried + (1 - own) * ideal[r][j], ring_joints[r], fairing));
    }
    rows.push_back(row);
  }
  return rows;
}

void close_with_pole(MannequinBuilder& builder, std::vector<std::vector<int>>& rows, const Vector3d& tip, int joint) {
  rows.emplace_back(rows.back().size(), builder.add(tip, joint));
}

}  // namespace degas
