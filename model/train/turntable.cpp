#include "model/train/turntable.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace degas {
namespace {

/// A camera at `position` that looks at `target`, its y axis away from `up`; intrinsics of `like`, the principal point
/// centred.
Camera looking_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target, const Eigen::Vector3d& up,
                  const Camera& like) {
  Camera camera = like;
  camera.cx = like.width / 2.0;
  camera.cy = like.height / 2.0;
  const Eigen::Vector3d forward = (target - position).normalized();
  const Eigen::Vector3d right = forward.cross(up).normalized();
  camera.rotation.row(0) = right.transpose();
  camera.rotation.row(1) = forward.cross(right).transpose();
  camera.rotation.row(2) = forward.transpose();
  camera.translation = -camera.rotation * position;
  return camera;
}

}  // namespace

std::vector<Camera> turntable(const Avatar& avatar, const Capture& capture, const std::vector<int>& frames) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero(), center = Eigen::Vector3d::Zero();
  for (int frame : frames) {
    const JointFrames joints = avatar.body().posed_joints(capture.pose(frame), avatar.betas());
    up += joints.rotations[0] * Eigen::Vector3d::UnitY();
    center += joints.positions[0];
  }
  up.normalize();
  center /= static_cast<double>(frames.size());

  const Camera first = capture.camera(0);
  Eigen::Vector3d arm = first.center() - center;
  arm -= up * up.dot(arm);
  const double distance = (first.center() - center).norm();
  if (arm.norm() < 1e-6 * distance) arm = up.unitOrthogonal();  // a camera straight above
  arm *= distance / arm.norm();
  std::vector<Camera> cameras;
  for (size_t i = 0; i < frames.size(); ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(frames.size());
    cameras.push_back(looking_at(center + Eigen::AngleAxisd(angle, up) * arm, center, up, first));
  }
  return cameras;
}

}  // namespace degas
