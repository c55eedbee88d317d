#include "bench/stability/twist.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "host/ops/skinning.h"

namespace degas::bench {
namespace {

constexpr double pi = 3.14159265358979323846;

Eigen::Matrix3d covariance(const Eigen::Matrix3d& turn, const Eigen::Vector3d& scales) {
  const Eigen::Matrix3d m = turn * scales.asDiagonal();
  return m * m.transpose();
}

const Eigen::Vector3d scales(0.02, 0.1, 0.05);

Eigen::Quaterniond own_rotation() {
  return Eigen::Quaterniond(0.8, 0.3, -0.2, 0.4).normalized();
}

Eigen::Matrix3d turned(double by) {
  return Eigen::AngleAxisd(by, Eigen::Vector3d::UnitX()).toRotationMatrix() * own_rotation().toRotationMatrix();
}

StressPoint point_of(double degrees, const Eigen::Matrix3d& found) {
  const double angle = degrees * pi / 180;
  const auto error = [&](double by) {
    const Eigen::Matrix3d reference = covariance(turned(by), scales);
    return (found - reference).cwiseAbs().maxCoeff() / reference.cwiseAbs().maxCoeff();
  };
  const double least = degrees == 180 ? std::min(error(angle / 2), error(angle / 2 - pi)) : error(angle / 2);
  return {degrees, least, least};
}

Eigen::Matrix3d our_covariance(Device& device, double angle) {
  Tape tape(device, false);
  const auto tensor = [&](const Shape& shape, const std::vector<double>& values) {
    return Tensor::from(device, shape, std::span<const double>(values));
  };
  const std::vector<int32_t> parents = {-1, 0}, joints = {0, 1};
  const JointTransforms transforms =
      kinematics(tape, tensor({2, 3}, {0, 0, 0, angle, 0, 0}), tensor({3}, {0, 0, 0}),
                 tensor({2, 3}, {0, 0, 0, 0.3, 0, 0}), Tensor::from(device, {2}, std::span<const int32_t>(parents)));
  const SkinningWeights weights{Tensor::from(device, {1, 2}, std::span<const int32_t>(joints)),
                                tensor({1, 2}, {0.5, 0.5})};
  const Eigen::Quaterniond own = own_rotation();
  const std::vector<double> q =
      skin_rotations(tape, tensor({1, 4}, {own.w(), own.x(), own.y(), own.z()}), weights, transforms).to_host<double>();
  return covariance(Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix(), scales);
}

}  // namespace

StressAxis twist_axis(const std::vector<StressedDevice>& devices) {
  StressAxis axis{"twist between two joints", "degrees", 0, 180, {}};
  for (const StressedDevice& ours : devices) axis.series.push_back({ours.name, true, {}});
  axis.series.push_back({"blended matrices", false, {}});
  for (double degrees = 0; degrees <= 180; degrees += 7.5) {
    const double angle = degrees * pi / 180;
    auto series = axis.series.begin();
    for (const StressedDevice& ours : devices)
      (series++)->points.push_back(point_of(degrees, our_covariance(ours.device, angle)));
    series->points.push_back(point_of(degrees, covariance(0.5 * (turned(0) + turned(angle)), scales)));
  }
  return axis;
}

}  // namespace degas::bench
