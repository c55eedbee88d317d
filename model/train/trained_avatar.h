#pragma once

#include <map>
#include <memory>
#include <string>

#include "model/train/avatar.h"
#include "model/train/face_codes.h"
#include "model/train/pose_correction.h"
#include "model/train/run_folder.h"

namespace degas {

/// An avatar as a training run left it, driven by any capture's signals. The frames whose poses training refined use
/// the refined ones, but only with the very capture they were refined on: a novel sequence has its own registration, or
/// what PoseFitter made of it.
class TrainedAvatar {
 public:
  /// Throws Error naming the run's file that is missing or does not fit.
  TrainedAvatar(Device& device, const RunFolder& run);

  const Config& config() const { return config_; }
  Avatar& avatar() { return *avatar_; }
  const Avatar& avatar() const { return *avatar_; }
  /// Of all that was trained: the network's parameters and the refined poses. Waits for the device.
  uint64_t checksum() const;
  int64_t steps_trained() const { return steps_; }

  /// Of the seen cameras alone. A capture without codes drives the face with zeros. Throws Error when its codes have
  /// another length than the trained ones.
  FaceCodes face_codes(const Capture& capture) const;

  /// Cameras of `capture` that training used or might have used, by name: those of data.cameras (or all) without
  /// data.hold_out.
  std::vector<int> seen_cameras(const Capture& capture) const;

  /// The capture in the registration that training knew, where it is the recording of the training: data.corruption
  /// moved it, and what training refined starts there. Its pictures and codes stay right, and so does any other
  /// capture.
  std::unique_ptr<Capture> as_registered(std::unique_ptr<Capture> capture) const;

  bool has_refined_poses() const { return !corrections_.empty(); }
  /// Whether this frame is drawn with a refined pose.
  bool is_refined(const Capture& capture, int frame) const;

  /// The capture's pose of a frame with its finger angles whole (Avatar::registered_pose), refined where is_refined.
  Pose best_pose(const Capture& capture, int frame) const;

  /// The pose of the signal, refined where is_refined.
  Splats pose(Tape& tape, const CanonicalGaussians& gaussians, const Avatar::Signal& signal, const Capture& capture,
              int frame) const;
  /// Upload, decode and pose in one.
  Splats drive(Tape& tape, const Capture& capture, FaceCodes& codes, int frame);

 private:
  Config config_;
  std::string picture_identity_;  // of the capture whose poses were refined: other codes change nothing in them
  int64_t steps_ = 0;
  int face_code_size_ = 0;
  std::unique_ptr<Avatar> avatar_;
  std::map<int, PoseCorrection> corrections_;
};

}  // namespace degas
