#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "model/train/trained_avatar.h"

namespace degas {

struct PoseFitOptions {
  std::vector<int> cameras;  ///< of the capture: those whose pictures a pose is fitted to; at least one
  int steps = 30;            ///< for each frame; each draws every camera
  std::function<bool()> stop_requested = [] { return false; };
};

/// The pose of one frame, and what it came from.
struct FittedPose {
  Pose pose;      ///< fingers as whole angles (BodyModel::with_hands); jaw and expression as registered
  int views = 0;  ///< pictures it was fitted to; 0: none had one, the pose is as it was
  double loss_before = 0, loss_after = 0;      ///< L1 and SSIM as loss.ssim_weight has them, mean over the views
  double degrees_moved = 0, metres_moved = 0;  ///< of the joint that turned most; of the body
};

/// Fits the registered poses of a capture to its pictures, by the trained avatar: the Gaussians that the network makes
/// of the registered pose stay, and what skins them follows the gradient of the drawn pictures (Rprop, as poses are
/// refined in training). What a tracker left off is undone where cameras see it; joints that they hardly see stay as
/// they were. Neither network nor face signal change.
class PoseFitter {
 public:
  /// Everything given must outlive it. Throws Error where no camera is named.
  PoseFitter(Device& device, TrainedAvatar& avatar, const Capture& capture, PoseFitOptions options);

  /// Same frame, same device: the same bits. A pose is left as it was where the avatar that is driven by the new one
  /// draws no better. Nothing when it was stopped.
  std::optional<FittedPose> fit(int frame);

 private:
  struct View {
    Camera camera;
    Tensor target;
    std::array<double, 3> background;
  };
  /// The pictures of a frame, cut to where the person is seen or registered.
  std::vector<View> load_views(int frame, const Pose& registered) const;
  /// The share of views[begin .. end) in the mean over all of them.
  Tensor loss(Tape& tape, const CanonicalGaussians& gaussians, const DevicePose& body, const std::vector<View>& views,
              size_t begin, size_t end);
  /// Of the avatar as network input and skeleton both have the pose.
  double loss_driven_by(const Pose& pose, int frame, const std::vector<View>& views);
  Avatar::Signal signal(const Pose& pose, int frame);

  Device& device_;
  TrainedAvatar& avatar_;
  const Capture& capture_;
  PoseFitOptions options_;
  FaceCodes codes_;
  Tensor refined_;
  SplatWorkspace workspace_;
};

}  // namespace degas
