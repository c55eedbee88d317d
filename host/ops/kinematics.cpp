#include "host/ops/kinematics.h"

#include <fmt/format.h>

#include <stdexcept>

namespace degas {

JointTransforms kinematics(Tape& tape, const Tensor& axis_angles, const Tensor& translation, const Tensor& rest_joints,
                           const Tensor& parents) {
  const int joints = static_cast<int>(parents.size());
  if (axis_angles.size() != joints * 3 || rest_joints.size() != joints * 3 || translation.size() != 3) {
    throw std::logic_error(fmt::format(
        "[kinematics] {} parents need axis angles and rest joints (J,3), translation (3); got {}, {}, {}", joints,
        to_string(axis_angles.shape()), to_string(rest_joints.shape()), to_string(translation.shape())));
  }
  Device& device = tape.device();
  const JointTransforms output{Tensor(device, {joints, 3, 4}), Tensor(device, {joints, 4})};
  device.kernel("kinematics", "kinematics_forward")
      .launch({1}, {1}, axis_angles, translation, rest_joints, parents, output.matrices, output.rotations, joints);
  tape.record("kinematics", {axis_angles, translation}, {output.matrices, output.rotations}, [=](Tape& tape) {
    Device& device = tape.device();
    // The kernel adds along the tree in place.
    const Tensor d_axis_angles(device, axis_angles.shape()), d_translation(device, translation.shape());
    device.kernel("kinematics", "kinematics_backward")
        .launch({1}, {1}, axis_angles, rest_joints, parents, output.rotations,
                tape.own_gradient_or_zeros(output.matrices), tape.own_gradient_or_zeros(output.rotations),
                d_axis_angles, d_translation, joints);
    tape.accumulate(axis_angles, d_axis_angles);
    tape.accumulate(translation, d_translation);
  });
  return output;
}

}  // namespace degas
