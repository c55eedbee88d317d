#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/io/onnx_model.h"
#include "model/faces/face_boxes.h"

namespace degas {

/// How far a head is turned off the camera, in radians, by what a network of head poses gives: 3 numbers, yaw, pitch
/// and roll in degrees; or 9 or 12, the rows of the head's rotation in the camera's axes, 3x3 or beside a translation
/// 3x4, at any scale. Roll turns nobody away. Throws Error beginning with `label` for other counts and what is not
/// finite.
double angle_off_front(std::span<const float> output, const std::string& label);

/// An ONNX network from pictures of faces to head poses.
class HeadPoseNetwork {
 public:
  /// Errors as OnnxModel throws them.
  HeadPoseNetwork(const std::filesystem::path& path, const OnnxInput& input, const std::string& output);

  /// Radians off the front of a face in a square picture of side().
  double angle(const Image8& face);
  int side() const { return input_.side; }
  /// All that its angles depend on.
  nlohmann::json description() const;

 private:
  std::filesystem::path path_;
  OnnxInput input_;
  std::string output_;
  OnnxModel model_;
};

/// The faces that have a picture, ranked by the network's angle of the square around each that is `margin` pixels wider
/// on every side; those of more than `max_angle` radians are left out. `go_on` is told of faces done and in all; when
/// it returns false, nothing is returned.
std::optional<std::vector<FaceBox>> ranked_by_head_pose(const Capture& capture, const std::vector<FaceBox>& faces,
                                                        HeadPoseNetwork& network, int margin, double max_angle,
                                                        const std::function<bool(int done, int total)>& go_on);

}  // namespace degas
