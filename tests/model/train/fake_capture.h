#pragma once

#include <functional>

#include "model/body/body_model.h"
#include "model/data/capture.h"

namespace degas::test {

/// A capture made of answers: every view has a picture unless has_picture says otherwise; masks are a box.
class FakeCapture : public Capture {
 public:
  int frames = 4;
  std::vector<std::string> names = {"cam00", "cam01", "cam02", "cam03"};
  std::function<bool(int frame, int camera)> has_picture = [](int, int) { return true; };
  std::function<std::vector<float>(int frame, int camera)> code;  ///< an empty one: none
  std::function<Camera(int camera)> view = [](int) {
    Camera camera;
    camera.width = 100;
    camera.height = 120;
    return camera;
  };
  int code_size = 2;
  Eigen::Vector3d jaw = Eigen::Vector3d::Zero();
  std::vector<double> expression;
  int box_width = 20, box_height = 50;  ///< of the mask in frame 0; a pixel more each way in each frame

  std::string identity() const override { return "fake"; }
  int frame_count() const override { return frames; }
  const std::vector<std::string>& camera_names() const override { return names; }
  Camera camera(int camera) const override { return view(camera); }
  bool has_image(int frame, int camera) const override { return has_picture(frame, camera); }
  Sample load(int frame, int camera) const override {
    const Camera at = view(camera);
    Sample sample{frame, camera, at, Image8::black(at.width, at.height, 3), Image8::black(at.width, at.height, 1)};
    for (int y = 0; y < box_height + frame; ++y) {
      for (int x = 0; x < box_width + frame; ++x) *sample.mask.at(x + 10, y + 30) = 255;
    }
    return sample;
  }
  Pose pose(int) const override {
    Pose pose{std::vector<Eigen::Vector3d>(55, Eigen::Vector3d::Zero()), Eigen::Vector3d::Zero(), expression};
    pose.axis_angles[JawJoint] = jaw;
    return pose;
  }
  std::vector<double> betas() const override { return {}; }
  bool flat_hand_mean() const override { return true; }
  int face_code_size() const override { return code_size; }
  std::optional<std::vector<float>> face_code(int frame, int camera) const override {
    std::vector<float> values = code(frame, camera);
    if (values.empty()) return std::nullopt;
    return values;
  }
};

}  // namespace degas::test
