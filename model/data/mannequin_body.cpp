#include "model/data/mannequin_body.h"

#include <Eigen/Dense>
#include <algorithm>
#include <numeric>

#include "model/data/mannequin_parts.h"

namespace degas {
namespace {

using Eigen::Vector3d;

/// Rounds of diffusion: many where edges are long and motion is soft, few at fingers.
int diffusion_rounds(int joint) {
  if (joint >= 25) return 4;                              // fingers
  if (joint == 20 || joint == 21) return 5;               // hands
  if (joint == 18 || joint == 19) return 8;               // forearms
  if (joint == 16 || joint == 17) return 14;              // upper arms
  if (joint == 4 || joint == 5) return 9;                 // shins
  if (joint >= 7 && joint <= 11 && joint != 9) return 6;  // feet
  return 16;
}

}  // namespace

int MannequinBuilder::add(const Vector3d& position, int follows_joint, double fairing, bool lower) {
  joint.push_back(follows_joint);
  smoothing.push_back(fairing);
  below_mouth.push_back(lower);
  return mesh.add_vertex(position);
}

Eigen::MatrixXf diffuse_weights(const MannequinBuilder& builder) {
  const auto around = builder.mesh.neighbors();
  const Eigen::Index count = static_cast<Eigen::Index>(around.size());
  // Row-major: the inner loop runs over the joints of one vertex.
  using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Matrix weights = Matrix::Zero(count, mannequin_joint_count);
  for (Eigen::Index v = 0; v < count; ++v) weights(v, builder.joint[v]) = 1;
  for (int round = 0; round < 16; ++round) {
    Matrix next = weights;
    for (Eigen::Index v = 0; v < count; ++v) {
      if (round >= diffusion_rounds(builder.joint[v]) || around[v].empty()) continue;
      Eigen::RowVectorXf mean = Eigen::RowVectorXf::Zero(mannequin_joint_count);
      for (const int n : around[v]) mean += weights.row(n);
      next.row(v) = 0.5F * weights.row(v) + 0.5F / static_cast<float>(around[v].size()) * mean;
    }
    weights.swap(next);
  }
  weights = (weights.array() < 0.004F).select(0.0F, weights);
  for (Eigen::Index v = 0; v < count; ++v) weights.row(v) /= weights.row(v).sum();
  return weights;
}

Eigen::MatrixXf joint_regressor(const MannequinBuilder& builder) {
  constexpr int support = 160;
  const auto& vertices = builder.mesh.vertices;
  Eigen::MatrixXf regressor = Eigen::MatrixXf::Zero(mannequin_joint_count, static_cast<Eigen::Index>(vertices.size()));
  for (int j = 0; j < mannequin_joint_count; ++j) {
    const Vector3d target = builder.skeleton.joints[j];
    std::vector<int> order(vertices.size());
    std::iota(order.begin(), order.end(), 0);
    std::partial_sort(order.begin(), order.begin() + support, order.end(), [&](int a, int b) {
      const double da = (vertices[a] - target).squaredNorm(), db = (vertices[b] - target).squaredNorm();
      return da < db || (da == db && a < b);
    });
    // Smallest weights with sum 1 and first moment at the joint.
    Eigen::Matrix<double, 4, support> moments;
    for (int k = 0; k < support; ++k) moments.col(k) << vertices[order[k]] - target, 1.0;
    moments.topRows<3>() *= 10;  // metres against a sum of one: better conditioned
    const Eigen::Vector4d goal(0, 0, 0, 1);
    const Eigen::VectorXd weights = moments.completeOrthogonalDecomposition().solve(goal);
    for (int k = 0; k < support; ++k) regressor(j, order[k]) = static_cast<float>(weights[k]);
  }
  return regressor;
}

MannequinBody build_mannequin() {
  MannequinBuilder builder;
  const TorsoGrid torso = add_torso(builder);
  add_head(builder, torso.rows.back());
  add_arm(builder, torso, true);
  add_arm(builder, torso, false);
  add_legs(builder, torso);
  builder.mesh.smooth(builder.smoothing, 14);
  MannequinBody body;
  body.skeleton = builder.skeleton;
  body.weights = diffuse_weights(builder);
  body.joint_regressor = joint_regressor(builder);
  body.shapes = body_shapes(builder);
  body.expressions = expression_shapes(builder);
  body.below_mouth = builder.below_mouth;
  body.mesh = std::move(builder.mesh);
  return body;
}

}  // namespace degas
