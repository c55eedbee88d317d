#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "model/data/smplx_parameters.h"
#include "model/train/pose_fit.h"

namespace degas {

/// The file that `degas fit-poses` makes: body parameters of every frame of a capture, as smplx.npz has them, with
/// fingers by whole angles; frames that were not fitted have their registered pose. Besides, for going on: `fitted` (T)
/// and `fit`, a JSON text of what the poses were fitted by.
class FittedPoses {
 public:
  /// All frames as they are registered, refined where training did. Nothing is written yet.
  FittedPoses(std::filesystem::path file, const TrainedAvatar& avatar, const Capture& capture,
              const PoseFitOptions& options);

  /// Takes what the file has. Error naming it when it is missing, of another capture, or fitted by something else.
  void resume();
  bool has(int frame) const { return fitted_.at(static_cast<size_t>(frame)) != 0; }
  void set(int frame, const FittedPose& fitted);
  void save() const;
  /// Of what was set: frames, pictures, the loss before and after, how far poses moved (medians).
  std::string summary() const;

 private:
  std::filesystem::path file_;
  SmplxParameters parameters_;
  std::vector<uint8_t> fitted_;
  std::string fitted_by_;
  std::vector<FittedPose> all_;
};

/// Fits the frames that `poses` lacks; saves every half minute and at the end. False when it was stopped.
bool fit_frames(PoseFitter& fitter, FittedPoses& poses, const std::vector<int>& frames,
                const std::function<bool()>& stop_requested,
                const std::function<void(int done, const FittedPose& fitted)>& progress);

}  // namespace degas
