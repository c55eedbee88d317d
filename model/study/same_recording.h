#pragma once

#include <memory>

#include "model/data/capture.h"

namespace degas {

/// A capture opened at another scale than a run was trained at, which the run still knows as its own: the poses that
/// training refined belong to the recording, whatever the size of its pictures.
class SameRecording final : public Capture {
 public:
  /// picture_identity: of the capture as the run was trained on it.
  SameRecording(std::unique_ptr<Capture> capture, std::string picture_identity)
      : capture_(std::move(capture)), picture_identity_(std::move(picture_identity)) {}

  std::string identity() const override { return capture_->identity(); }
  std::string picture_identity() const override { return picture_identity_; }
  int frame_count() const override { return capture_->frame_count(); }
  int64_t frame_number(int frame) const override { return capture_->frame_number(frame); }
  const std::vector<std::string>& camera_names() const override { return capture_->camera_names(); }
  Camera camera(int camera) const override { return capture_->camera(camera); }
  bool has_image(int frame, int camera) const override { return capture_->has_image(frame, camera); }
  Sample load(int frame, int camera) const override { return capture_->load(frame, camera); }
  Pose pose(int frame) const override { return capture_->pose(frame); }
  std::vector<double> betas() const override { return capture_->betas(); }
  bool flat_hand_mean() const override { return capture_->flat_hand_mean(); }
  bool has_poses() const override { return capture_->has_poses(); }
  bool has_masks() const override { return capture_->has_masks(); }
  int face_code_size() const override { return capture_->face_code_size(); }
  std::optional<std::vector<float>> face_code(int frame, int camera) const override {
    return capture_->face_code(frame, camera);
  }
  bool has_face_code(int frame, int camera) const override { return capture_->has_face_code(frame, camera); }

 private:
  std::unique_ptr<Capture> capture_;
  std::string picture_identity_;
};

}  // namespace degas
