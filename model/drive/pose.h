#pragma once

#include <Eigen/Core>
#include <vector>

namespace degas {

/// Body parameters of one frame, in SMPL-X's terms.
struct Pose {
  std::vector<Eigen::Vector3d> axis_angles;               ///< J joints, radians; the root's global orientation at 0
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< metres, added after the root has turned
  std::vector<double> expression;                         ///< coefficients of the body model's expression basis
};

}  // namespace degas
