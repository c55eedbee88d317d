#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "model/data/smplx_parameters.h"
#include "model/train/pose_fit.h"

namespace degas {

/// The file that `degas fit-poses` makes: body parameters of every frame of a capture, as smplx.npz has them, for the
/// avatar's shape, with fingers by whole angles; frames that were not fitted have the pose that they had. Besides, for
/// going on and for whoever measures by it: `fitted` (T), 1 for frames that are done with, and `fit`, a JSON text of
/// what poses were fitted by.
class FittedPoses {
 public:
  /// All frames as they are registered, refined where training did. Nothing is written yet. Throws Error where the file
  /// could not hold them.
  FittedPoses(std::filesystem::path file, const TrainedAvatar& avatar, const Capture& capture,
              const PoseFitOptions& options);

  /// Takes what the file has. Error naming it when it is missing, of another capture, or fitted by something else.
  void resume();
  bool has(int frame) const { return done_.at(static_cast<size_t>(frame)) != 0; }
  void set(int frame, const FittedPose& fitted);
  void save() const;
  /// Of what was set: frames, pictures, the loss before and after, how far poses moved (medians).
  std::string summary() const;

 private:
  std::filesystem::path file_;
  SmplxParameters parameters_;
  std::vector<uint8_t> done_;
  std::string fitted_by_;
  std::vector<FittedPose> set_now_;  // not by an earlier process
};

/// Fits the frames that `poses` lacks; saves every half minute, at the end and before an Error. False when it was
/// stopped (PoseFitOptions::stop_requested). Throws Error where none of the frames has a picture.
bool fit_frames(PoseFitter& fitter, FittedPoses& poses, const std::vector<int>& frames,
                const std::function<void(int done, const FittedPose& fitted)>& progress);

/// Warns of each of the cameras that `degas fit-poses` fitted the poses of a file to: what is measured on it is not
/// unseen.
void warn_of_fitted_cameras(const std::filesystem::path& poses, const std::vector<std::string>& cameras);

}  // namespace degas
