#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>

#include "model/config.h"
#include "model/data/wrapped_capture.h"
#include "model/train/run_folder.h"
#include "tests/support/temporary_folder.h"

namespace degas::test {

/// A synthetic capture of 6 + 2 frames and 5 cameras of 64x80 pixels: P1C1, P1C2 and body.npz in a folder that is made
/// once a program and goes with it.
const std::filesystem::path& training_scene();

/// Opens a sequence of the scene; its decoded pictures are cached beside it.
std::unique_ptr<Capture> open_scene(const std::string& sequence = "P1C1");

/// A config that trains on the scene some ten steps a second: no perceptual loss, two views a step, a line of history
/// every step, checkpoints at the end only.
Config tiny_config();

/// A run folder in `folder`, created for this config and the scene's body.
RunFolder make_run(const std::filesystem::path& folder, const Config& config);

/// A run trained for a few steps on a sequence's capture.
RunFolder train_run(const std::filesystem::path& folder, const Config& config, const Capture& capture);

/// A capture (the scene's P1C1) with changed answers; what is not set is as it was.
class ChangedCapture : public WrappedCapture {
 public:
  explicit ChangedCapture(std::unique_ptr<Capture> source = open_scene()) : WrappedCapture(std::move(source)) {}

  std::function<void(Camera&)> change_camera;
  std::function<void(int frame, Pose&)> change_pose;
  std::function<bool(int frame, int camera)> lacks_image;
  std::function<void(Sample&)> change_sample;
  std::function<std::optional<std::vector<float>>(int frame, int camera)> replace_code;
  std::optional<int> code_size;
  bool flat_hands = true;

  Camera camera(int camera) const override {
    Camera view = source().camera(camera);
    if (change_camera) change_camera(view);
    return view;
  }
  bool has_image(int frame, int camera) const override {
    return !(lacks_image && lacks_image(frame, camera)) && source().has_image(frame, camera);
  }
  Sample load(int frame, int camera) const override {
    if (!has_image(frame, camera)) throw std::logic_error("a picture was asked for that is not there");
    Sample sample = source().load(frame, camera);
    sample.view = this->camera(camera);
    if (change_sample) change_sample(sample);
    return sample;
  }
  Pose pose(int frame) const override {
    Pose pose = source().pose(frame);
    if (change_pose) change_pose(frame, pose);
    return pose;
  }
  bool flat_hand_mean() const override { return flat_hands; }
  int face_code_size() const override { return code_size.value_or(source().face_code_size()); }
  std::optional<std::vector<float>> face_code(int frame, int camera) const override {
    return replace_code ? replace_code(frame, camera) : source().face_code(frame, camera);
  }
  bool has_face_code(int frame, int camera) const override { return face_code(frame, camera).has_value(); }
};

}  // namespace degas::test
