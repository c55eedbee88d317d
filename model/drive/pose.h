#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace degas {

/// Body parameters of one frame, in SMPL-X's terms.
struct Pose {
  std::vector<Eigen::Vector3d> axis_angles;               ///< J joints, radians; the root's global orientation at 0
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< metres, added after the root has turned
  std::vector<double> expression;                         ///< coefficients of the body model's expression basis
  /// Of the left and the right hand's principal components, where a capture gives fingers by them; their axis_angles
  /// are zero then, until BodyModel::with_hands. Empty: axis_angles have the fingers.
  std::array<std::vector<double>, 2> hand_coefficients = {};
};

}  // namespace degas
