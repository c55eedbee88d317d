#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "host/ops/pointwise.h"
#include "model/train/avatar.h"

namespace degas {

/// Which angles training refines, (J, 3): all but the jaw's are 1. The face signal alone moves the jaw: one that
/// training could fit to each frame would be learnt by heart rather than from the signal, and stay shut in a novel
/// sequence.
inline Tensor refined_angles(Device& device, int joint_count) {
  std::vector<float> refined(static_cast<size_t>(joint_count) * 3, 1.0F);
  if (joint_count > JawJoint) std::fill_n(refined.begin() + 3 * JawJoint, 3, 0.0F);
  return Tensor::from(device, {joint_count, 3}, std::span<const float>(refined));
}

/// What training adds to the registered pose of one frame when train.refine_poses is on; zero at first.
struct PoseCorrection {
  Tensor axis_angles;  ///< (J, 3), radians, root included; without effect on the jaw
  Tensor translation;  ///< (3), metres

  /// refined: refined_angles, which all frames share.
  PoseCorrection(Device& device, Tensor refined)
      : axis_angles(Tensor::zeros(device, refined.shape())),
        translation(Tensor::zeros(device, {3})),
        refined_(std::move(refined)) {}

  DevicePose apply(Tape& tape, const DevicePose& registered) const {
    return {add(tape, registered.axis_angles, multiply(tape, axis_angles, refined_)),
            add(tape, registered.translation, translation)};
  }
  /// The same on the host. Waits for the device.
  void apply(Pose& registered) const {
    const std::vector<float> angles = axis_angles.to_host<float>(), refined = refined_.to_host<float>();
    for (size_t i = 0; i < angles.size(); ++i)
      registered.axis_angles[i / 3][static_cast<Eigen::Index>(i % 3)] += angles[i] * refined[i];
    const std::vector<float> moved = translation.to_host<float>();
    registered.translation += Eigen::Vector3d(moved[0], moved[1], moved[2]);
  }
  /// Name of a part ("axis_angles" or "translation") among the trained parameters.
  static std::string name(int frame, const char* part) { return fmt::format("pose.{:06}.{}", frame, part); }

 private:
  Tensor refined_;
};

}  // namespace degas
