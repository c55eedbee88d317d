#pragma once

#include <vector>

#include "host/ops/camera.h"
#include "model/data/mannequin_clothes.h"

namespace degas {

/// Plays the part of a 2-D portrait encoder: a fixed, mildly non-linear embedding of the face's state.
class MannequinFaceEncoder {
 public:
  explicit MannequinFaceEncoder(int code_size = 512);

  /// Angle (degrees, 0..180) between the face's direction and the camera's, seen from above.
  static double yaw(const MannequinSkeleton& skeleton, const MannequinPose& pose, const Camera& camera);
  static constexpr double largest_yaw = 60;

  /// The code of a view at `yaw` degrees: noise grows with the angle, a little of the head's pose leaks in.
  /// `noise_seed` names the view and frame.
  std::vector<float> encode(const MannequinPose& pose, double yaw, uint64_t noise_seed) const;

 private:
  Eigen::MatrixXd linear_, bent_;  // (code, state)
  Eigen::VectorXd mean_;
};

}  // namespace degas
