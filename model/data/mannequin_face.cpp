#include <Eigen/Geometry>
#include <cmath>

#include "model/data/mannequin_parts.h"

namespace degas {
namespace {

using Eigen::Vector3d;

/// Displacement (metres) of a point of the head at coefficient 1. `below` = on the lower lip's side.
/// The lids' closing is not here: it depends on the grid, not on the place.
Vector3d displacement(MannequinExpression expression, const Vector3d& p, bool below) {
  const double side = p.x() < 0 ? -1 : 1, x = std::abs(p.x()), from_mouth = p.y() - mouth_height;
  const double face = smoothstep(0.02, 0.06, p.z());  // nothing behind the ears moves
  const double corner = bell(x - 0.027, 0.014) * bell(from_mouth, 0.014);
  const double lips = bell(from_mouth, 0.012) * (1 - smoothstep(0.028, 0.045, x));
  const double middle = bell(x, 0.019) * bell(from_mouth, 0.0095);
  switch (expression) {
    case MannequinExpression::JawOpen:
      if (!below) break;
      return Vector3d(0, -0.010, -0.002) * (face * (1 - smoothstep(0.03, 0.06, x)) * smoothstep(1.52, 1.54, p.y()));
    case MannequinExpression::LipWide:
      return face * Vector3d(side * (0.009 * corner + 0.006 * lips * std::min(1.0, x / 0.02)), 0, -0.003 * corner);
    case MannequinExpression::LipPucker:
      return face * Vector3d(-0.45 * p.x() * lips, 0, 0.009 * bell(x, 0.022) * bell(from_mouth, 0.014));
    case MannequinExpression::Smile:
      return face * (Vector3d(side * 0.008, 0.010, -0.004) * corner +
                     Vector3d(side * 0.001, 0.005, 0.003) * bell(x - 0.043, 0.018) * bell(p.y() - 1.598, 0.018));
    case MannequinExpression::MouthFrown:
      return face * (Vector3d(0, -0.009, -0.001) * corner + Vector3d(0, 0.003, 0.002) * (below ? middle : 0));
    case MannequinExpression::UpperLipRaise:
      if (below) break;
      return {0, 0.0065 * face * bell(x, 0.020) * bell(from_mouth, 0.013), 0};
    case MannequinExpression::LowerLipDrop:
      if (!below) break;
      return {0, -0.0075 * face * bell(x, 0.020) * bell(from_mouth, 0.013), 0};
    case MannequinExpression::BrowRaise:
      return face * Vector3d(0, 0.0085, 0.001) * bell(p.y() - 1.664, 0.014) * (1 - smoothstep(0.045, 0.065, x));
    case MannequinExpression::BrowFrown:
      return face * Vector3d(-side * 0.0045 * smoothstep(0.002, 0.010, x), -0.0065, 0.002) *
             bell(p.y() - 1.661, 0.011) * bell(x - 0.012, 0.018);
    case MannequinExpression::Squint:
      return face * Vector3d(0, 0.0035, 0.001) * bell(p.y() - 1.625, 0.009) * bell(x - 0.0315, 0.018);
    case MannequinExpression::CheekPuff:
      return face * Vector3d(side * 0.008, 0, 0.007) * bell(x - 0.040, 0.018) * bell(p.y() - 1.580, 0.020);
    case MannequinExpression::LidsClose:
      break;
  }
  return Vector3d::Zero();
}

}  // namespace

Eigen::MatrixXf expression_shapes(const MannequinBuilder& builder) {
  const auto& vertices = builder.mesh.vertices;
  Eigen::MatrixXf shapes =
      Eigen::MatrixXf::Zero(3 * static_cast<Eigen::Index>(vertices.size()), mannequin_expression_count);
  std::vector<bool> on_head(vertices.size(), false);
  for (size_t t = 0; t < builder.mesh.triangles.size(); ++t) {
    if (builder.mesh.triangle_charts[t] != MannequinChart::Head) continue;
    for (int k = 0; k < 3; ++k) on_head[builder.mesh.triangles[t][k]] = true;
  }
  for (int e = 0; e < mannequin_expression_count; ++e) {
    const auto expression = static_cast<MannequinExpression>(e);
    const auto column = [&](int vertex) { return shapes.block<3, 1>(3 * static_cast<Eigen::Index>(vertex), e); };
    for (size_t v = 0; v < vertices.size(); ++v) {
      if (!on_head[v]) continue;
      column(static_cast<int>(v)) = displacement(expression, vertices[v], builder.below_mouth[v]).cast<float>();
    }
    if (expression == MannequinExpression::LidsClose) {
      for (const auto& [vertex, closing] : builder.lid_closing) column(vertex) = closing.cast<float>();
    }
    for (const auto& follower : builder.followers) {
      column(follower.vertex) = static_cast<float>(follower.factor) * column(follower.source);
    }
  }
  // The lower teeth go with the jaw's blend shape.
  for (size_t t = 0; t < builder.mesh.triangles.size(); ++t) {
    if (builder.mesh.triangle_charts[t] != MannequinChart::LowerTeeth) continue;
    for (int k = 0; k < 3; ++k) {
      shapes.block<3, 1>(3 * static_cast<Eigen::Index>(builder.mesh.triangles[t][k]),
                         static_cast<int>(MannequinExpression::JawOpen)) = Eigen::Vector3f(0, -0.010F, -0.002F);
    }
  }
  return shapes;
}

Eigen::MatrixXf body_shapes(const MannequinBuilder& builder) {
  const auto& vertices = builder.mesh.vertices;
  Eigen::MatrixXf shapes = Eigen::MatrixXf::Zero(3 * static_cast<Eigen::Index>(vertices.size()), mannequin_shape_count);
  for (size_t v = 0; v < vertices.size(); ++v) {
    const Vector3d& p = vertices[v];
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(v);
    const double head = smoothstep(1.50, 1.54, p.y());
    shapes.block<3, 1>(row, 0) = (0.03 * p).cast<float>();
    shapes.block<3, 1>(row, 1) = (0.05 * (1 - head) * Vector3d(p.x(), 0, p.z())).cast<float>();
    shapes.block<3, 1>(row, 2) = (0.03 * head * (p - Vector3d(0, 1.50, -0.02))).cast<float>();
  }
  return shapes;
}

}  // namespace degas
