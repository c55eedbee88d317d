#pragma once

#include <memory>
#include <utility>

#include "model/data/capture.h"

namespace degas {

/// A capture that answers as the one inside it does: what derives from it overrides what it changes.
class WrappedCapture : public Capture {
 public:
  explicit WrappedCapture(std::unique_ptr<Capture> source) : source_(std::move(source)) {}

  std::string identity() const override { return source_->identity(); }
  std::string picture_identity() const override { return source_->picture_identity(); }
  int frame_count() const override { return source_->frame_count(); }
  int64_t frame_number(int frame) const override { return source_->frame_number(frame); }
  const std::vector<std::string>& camera_names() const override { return source_->camera_names(); }
  Camera camera(int camera) const override { return source_->camera(camera); }
  bool has_image(int frame, int camera) const override { return source_->has_image(frame, camera); }
  Sample load(int frame, int camera) const override { return source_->load(frame, camera); }
  Pose pose(int frame) const override { return source_->pose(frame); }
  std::vector<double> betas() const override { return source_->betas(); }
  bool flat_hand_mean() const override { return source_->flat_hand_mean(); }
  bool has_poses() const override { return source_->has_poses(); }
  bool has_masks() const override { return source_->has_masks(); }
  int face_code_size() const override { return source_->face_code_size(); }
  std::optional<std::vector<float>> face_code(int frame, int camera) const override {
    return source_->face_code(frame, camera);
  }
  bool has_face_code(int frame, int camera) const override { return source_->has_face_code(frame, camera); }

 protected:
  const Capture& source() const { return *source_; }

 private:
  std::unique_ptr<Capture> source_;
};

}  // namespace degas
