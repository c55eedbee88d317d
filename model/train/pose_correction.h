#pragma once

#include <fmt/format.h>

#include <string>

#include "host/ops/pointwise.h"
#include "model/train/avatar.h"

namespace degas {

/// What training adds to the registered pose of one frame when train.refine_poses is on; zero at first.
struct PoseCorrection {
  Tensor axis_angles;  ///< (J, 3), radians, root included
  Tensor translation;  ///< (3), metres

  PoseCorrection(Device& device, int joint_count)
      : axis_angles(Tensor::zeros(device, {joint_count, 3})), translation(Tensor::zeros(device, {3})) {}

  DevicePose apply(Tape& tape, const DevicePose& registered) const {
    return {add(tape, registered.axis_angles, axis_angles), add(tape, registered.translation, translation)};
  }
  /// Name of a part ("axis_angles" or "translation") among the trained parameters.
  static std::string name(int frame, const char* part) { return fmt::format("pose.{:06}.{}", frame, part); }
};

}  // namespace degas
