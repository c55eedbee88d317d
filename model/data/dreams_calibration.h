#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "host/ops/camera.h"

namespace degas {

/// What lies behind the person in the videos' colour half: white or black paper (colours are blended with it by alpha),
/// or the scene (colours are whole).
enum class DreamsBackground { White, Black, Scene };

/// What capture.json says.
struct DreamsDescription {
  int frame_offset = 0;                             ///< video frame = frame number + offset
  std::optional<int> colour_width;                  ///< columns of the colour half; otherwise half of the video
  std::optional<DreamsBackground> background;       ///< key video.background; otherwise measured on a frame
  std::optional<std::vector<int>> cameras_present;  ///< cameras that must have a video; otherwise those that have
};

/// Cameras of cameras.json at full size, in rig order. x_camera = R diag(1,-1,-1) x_world - R c. Errors name file, rig
/// and key.
std::vector<Camera> read_dreams_cameras(const std::filesystem::path& path);
DreamsDescription read_dreams_description(const std::filesystem::path& path);

}  // namespace degas
