#pragma once

#include <array>
#include <optional>
#include <vector>

#include "model/data/loader.h"
#include "model/drive/driving_signal.h"
#include "model/train/avatar.h"
#include "model/train/face_codes.h"
#include "model/train/training_views.h"

namespace degas {

/// A picture cut to the training window, ready for the device.
struct TrainingPicture {
  Camera view;         ///< of the window
  Image8 image, mask;  ///< foreground over black; alpha
  std::array<double, 3> background;
  std::optional<Rectangle> region;  ///< within the window: what the perceptual loss sees where it is not all
};

/// All that a step needs besides parameters.
struct PreparedStep {
  DrivingSignal signal;
  std::vector<TrainingPicture> pictures;
};

/// Prepares steps on the loader's thread: the same step gives the same bits, whenever it is asked for.
class StepPreparer {
 public:
  /// Everything given must outlive it.
  StepPreparer(const Config& config, const Capture& capture, const Avatar& avatar, const TrainingViews& views,
               FaceCodes& codes)
      : config_(config), capture_(capture), avatar_(avatar), views_(views), codes_(codes) {}

  PreparedStep prepare(int64_t step, const LoadRequest& request, const std::vector<Sample>& samples) const;
  TrainingPicture picture(const Sample& sample, const std::array<double, 3>& background) const;

 private:
  /// The frame's signal with the step's mixture of face codes.
  DrivingSignal signal(int64_t step, int frame) const;

  const Config& config_;
  const Capture& capture_;
  const Avatar& avatar_;
  const TrainingViews& views_;
  FaceCodes& codes_;
};

}  // namespace degas
