#include "model/faces/head_pose.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/error.h"
#include "model/faces/face_encoder.h"
#include "model/faces/face_encoding.h"

namespace degas {

double angle_off_front(std::span<const float> output, const std::string& label) {
  if (!std::all_of(output.begin(), output.end(), [](float value) { return std::isfinite(value); }))
    throw Error::format("{}: a head pose is not finite; its mean or scale are wrong", label);
  // The cosine of the angle between where the face looks and the way to the camera.
  double cosine = 0;
  if (output.size() == 3) {
    constexpr double degree = std::numbers::pi / 180;
    cosine = std::cos(output[0] * degree) * std::cos(output[1] * degree);
  } else if (output.size() == 9 || output.size() == 12) {
    const float* depth = output.data() + 2 * output.size() / 3;
    const double length =
        std::sqrt(static_cast<double>(depth[0]) * depth[0] + static_cast<double>(depth[1]) * depth[1] +
                  static_cast<double>(depth[2]) * depth[2]);
    if (!(length > 0)) throw Error::format("{}: a head pose's rotation is all zeros", label);
    cosine = depth[2] / length;
  } else {
    throw Error::format(
        "{}: a head pose of {} numbers, expected yaw, pitch and roll in degrees, or the 9 or 12 of a rotation; choose "
        "the "
        "output by output=NAME",
        label, output.size());
  }
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

HeadPoseNetwork::HeadPoseNetwork(const std::filesystem::path& path, const OnnxInput& input, const std::string& output)
    : path_(path), input_(input), output_(output), model_(path, input, output) {}

double HeadPoseNetwork::angle(const Image8& face) {
  return angle_off_front(model_(face), path_.string());
}

nlohmann::json HeadPoseNetwork::description() const {
  return {{"onnx", file_description(path_)},
          {"input", input_.side},
          {"mean", input_.mean},
          {"scale", input_.scale},
          {"output", output_}};
}

std::optional<std::vector<FaceBox>> ranked_by_head_pose(const Capture& capture, const std::vector<FaceBox>& faces,
                                                        HeadPoseNetwork& network, int margin, double max_angle,
                                                        const std::function<bool(int done, int total)>& go_on) {
  std::vector<FaceBox> ranked;
  int done = 0;
  for (const FaceBox& face : faces) {
    if (!go_on(done++, static_cast<int>(faces.size()))) return std::nullopt;
    if (!capture.has_image(face.frame, face.camera)) continue;
    const int side = std::max(face.box.width, face.box.height) + 2 * margin;
    const Rectangle square = {face.box.left + (face.box.width - side) / 2, face.box.top + (face.box.height - side) / 2,
                              side, side};
    FaceBox again = face;
    again.rank = network.angle(face_picture(capture.load(face.frame, face.camera).image, square, network.side()));
    if (again.rank <= max_angle) ranked.push_back(again);
  }
  return ranked;
}

}  // namespace degas
