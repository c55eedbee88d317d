#include "model/gaussians/posing.h"

namespace degas {
namespace {

Tensor upload_points(Device& device, const std::vector<Eigen::Vector3d>& points) {
  const auto count = static_cast<int64_t>(points.size());
  return Tensor::from(device, {count, 3}, std::span<const double>(points.front().data(), count * 3));
}

template <typename Value>
Tensor upload_rows(Device& device, const std::vector<Value>& values, int64_t rows) {
  return Tensor::from(device, {rows, static_cast<int64_t>(values.size()) / rows}, std::span<const Value>(values));
}

}  // namespace

Skeleton make_skeleton(Device& device, const BodyModel& body, const std::vector<double>& betas) {
  return {upload_points(device, body.joints(betas)),
          Tensor::from(device, {body.joint_count()}, std::span<const int32_t>(body.parents()))};
}

DevicePose make_device_pose(Device& device, const Pose& pose) {
  return {upload_points(device, pose.axis_angles),
          Tensor::from(device, {3}, std::span<const double>(pose.translation.data(), 3))};
}

GaussianBase make_gaussian_base(Device& device, const BaseMaps& maps) {
  const auto count = static_cast<int64_t>(maps.covered.size());
  return {Tensor::from(device, {count}, std::span<const int32_t>(maps.covered)), upload_rows(device, maps.positions, count),
          upload_rows(device, maps.rotations, count), upload_rows(device, maps.log_scales, count)};
}

SkinningWeights make_skinning_weights(Device& device, const BaseMaps& maps) {
  const auto count = static_cast<int64_t>(maps.covered.size());
  return {upload_rows(device, maps.joints, count), upload_rows(device, maps.weights, count)};
}

Splats pose_gaussians(Tape& tape, const CanonicalGaussians& gaussians, const SkinningWeights& skinning,
                      const Skeleton& skeleton, const DevicePose& pose) {
  const JointTransforms transforms =
      kinematics(tape, pose.axis_angles, pose.translation, skeleton.rest_joints, skeleton.parents);
  return {skin_positions(tape, gaussians.positions, skinning, transforms),
          skin_rotations(tape, gaussians.rotations, skinning, transforms), gaussians.log_scales, gaussians.opacities,
          gaussians.colors, gaussians.harmonics};
}

}  // namespace degas
