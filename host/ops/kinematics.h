#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// The transform of every joint from the canonical (rest) pose to the posed one.
struct JointTransforms {
  Tensor matrices;   ///< (J,3,4): posed * inverse(canonical), metres
  Tensor rotations;  ///< (J,4): unit quaternions (w,x,y,z) of the same; their sign is arbitrary
};

/// Forward kinematics, root included: the root turns about its rest joint, then everything moves by `translation`.
///   axis_angles (J,3) radians, each relative to the joint's parent; translation (3) metres
///   rest_joints (J,3) metres; parents Int32 (J): -1 for joint 0, else less than the joint's own index
/// The gradient reaches axis_angles and translation, is finite at every angle, and stops at rest_joints.
/// Throws std::logic_error when shapes disagree.
JointTransforms kinematics(Tape& tape, const Tensor& axis_angles, const Tensor& translation, const Tensor& rest_joints,
                           const Tensor& parents);

}  // namespace degas
