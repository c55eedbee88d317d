#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "host/ops/camera.h"

namespace degas {

/// A way in which a capture's files may have been read wrongly, as what undoes it. What is not set stays as it is.
struct Misreading {
  std::string name;   ///< for inspect.json, e.g. "mirrored_image"
  std::string words;  ///< what is probably wrong and what to do
  std::function<Camera(const Camera&)> camera;
  /// A posed vertex (world, metres), given the translation that was added to it.
  std::function<Eigen::Vector3d(const Eigen::Vector3d& vertex, const Eigen::Vector3d& translation)> vertex;
  int frame_offset = 0;  ///< the pose of so many frames later
  bool mirrored_image = false, image_upside_down = false;
};

/// All that is tried: extrinsics read the wrong way round, flipped and swapped axes, units, frames that are off,
/// mirrored pictures.
const std::vector<Misreading>& misreadings();

}  // namespace degas
