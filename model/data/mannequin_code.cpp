#include "model/data/mannequin_code.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/random.h"

namespace degas {
namespace {

constexpr int face_states = mannequin_expression_count + 5, leaking_states = 3;

/// Expression, jaw, gaze; then the head's pose relative to the trunk, which leaks. Each about 0..1.
Eigen::VectorXd face_state(const MannequinPose& pose) {
  Eigen::VectorXd state(face_states + leaking_states);
  for (int e = 0; e < mannequin_expression_count; ++e) state[e] = pose.expression[e];
  state.segment<3>(mannequin_expression_count) = pose.axis_angles[22] / 0.3;
  state.segment<2>(mannequin_expression_count + 3) = pose.axis_angles[23].head<2>() / 0.5;
  state.tail<3>() = 0.08 * (pose.axis_angles[12] + pose.axis_angles[15]);
  return state;
}

}  // namespace

MannequinFaceEncoder::MannequinFaceEncoder(int code_size) {
  Random random(20240810);
  const auto fill = [&](Eigen::MatrixXd& matrix, double scale) {
    matrix.resize(code_size, face_states + leaking_states);
    for (int row = 0; row < code_size; ++row) {
      for (int column = 0; column < matrix.cols(); ++column) matrix(row, column) = scale * random.normal();
    }
  };
  fill(linear_, 0.35);
  fill(bent_, 0.8);
  mean_.resize(code_size);
  for (int row = 0; row < code_size; ++row) mean_[row] = 0.3 * random.normal();
}

double MannequinFaceEncoder::yaw(const MannequinSkeleton& skeleton, const MannequinPose& pose, const Camera& camera) {
  const Eigen::Affine3d head = pose_joints(skeleton, pose)[15];
  const Eigen::Vector3d forward = head.linear() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d toward = camera.center() - head * skeleton.joints[15];
  double difference = std::atan2(forward.x(), forward.z()) - std::atan2(toward.x(), toward.z());
  difference = std::remainder(difference, 2 * std::numbers::pi);
  return std::abs(difference) * 180 / std::numbers::pi;
}

std::vector<float> MannequinFaceEncoder::encode(const MannequinPose& pose, double yaw, uint64_t noise_seed) const {
  const Eigen::VectorXd state = face_state(pose);
  const Eigen::VectorXd code = mean_ + linear_ * state + 0.25 * (bent_ * state).array().tanh().matrix();
  const double angle = std::min(yaw / largest_yaw, 2.0), noise = 0.02 + 0.08 * angle * angle;
  Random random(noise_seed);
  std::vector<float> result(static_cast<size_t>(code.size()));
  for (size_t i = 0; i < result.size(); ++i) {
    result[i] = static_cast<float>(code[static_cast<Eigen::Index>(i)] + noise * random.normal());
  }
  return result;
}

}  // namespace degas
