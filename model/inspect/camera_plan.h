#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host/ops/camera.h"

namespace degas {

/// What stands in the plan: cameras with their names, and the body's bones as pairs of world points.
struct CameraPlan {
  std::vector<Camera> cameras;
  std::vector<std::string> names;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> bones;
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();  ///< unit vector of the world
};

/// Where the cameras stand about the person, as two <svg> elements drawn in parallel projection: from above, and in
/// space from 25 degrees above. A camera is the pyramid of what it sees. Scale in metres.
std::string camera_plan_svg(const CameraPlan& plan);

}  // namespace degas
