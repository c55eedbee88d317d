#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "model/data/capture.h"

namespace degas {

/// A capture whose pictures come from files of decoded frames, one file a camera, in `folder`/{picture identity
/// of the capture}: two captures, or two ways of opening one, never share a file. A camera is decoded when it is first
/// asked for (in frame order, once), written under a temporary name and renamed, so that an interrupted run or two runs
/// at a time do no harm. Frames whose picture is unusable (an empty mask, a frame that does not decode) count as
/// missing, with one warning a camera. Only the person's pixels are stored, without loss.
class CachedCapture : public Capture {
 public:
  CachedCapture(std::unique_ptr<Capture> source, const std::filesystem::path& folder,
                std::function<void(const std::string&)> warn);
  ~CachedCapture() override;

  std::string identity() const override { return source_->identity(); }
  std::string picture_identity() const override { return source_->picture_identity(); }
  int frame_count() const override { return source_->frame_count(); }
  int64_t frame_number(int frame) const override { return source_->frame_number(frame); }
  const std::vector<std::string>& camera_names() const override { return source_->camera_names(); }
  Camera camera(int camera) const override { return source_->camera(camera); }
  bool has_image(int frame, int camera) const override;
  Sample load(int frame, int camera) const override;
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

 private:
  class Store;
  const Store& store(int camera) const;
  void decode(int camera, const std::filesystem::path& path) const;

  std::unique_ptr<Capture> source_;
  std::filesystem::path folder_;
  std::function<void(const std::string&)> warn_;
  mutable std::vector<std::unique_ptr<std::mutex>> mutexes_;  // one a camera
  mutable std::vector<std::unique_ptr<Store>> stores_;
};

}  // namespace degas
