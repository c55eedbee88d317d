#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "host/io/lens.h"
#include "model/data/foreground.h"

namespace degas {

/// What capture.json says.
struct DreamsDescription {
  int frame_offset = 0;                             ///< video frame = frame number + offset
  std::optional<int> colour_width;                  ///< columns of the colour half; otherwise half of the video
  std::optional<Background> background;             ///< key video.background; otherwise measured on a frame
  std::optional<std::vector<int>> cameras_present;  ///< cameras that must have a video; otherwise those that have
};

/// Cameras of cameras.json at full size, in rig order. x_camera = R diag(1,-1,-1) x_world - R c. A camera may have
/// "distortion", OpenCV's coefficients, which DREAMS' own files do not. Errors name file, rig and key.
std::vector<Lens> read_dreams_cameras(const std::filesystem::path& path);
DreamsDescription read_dreams_description(const std::filesystem::path& path);

}  // namespace degas
