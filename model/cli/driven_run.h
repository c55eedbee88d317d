#pragma once

#include <filesystem>
#include <memory>

#include "model/cli/shared_options.h"
#include "model/train/trained_avatar.h"

namespace degas {

/// A trained avatar and the capture that drives it, as the options of a command say.
struct DrivenRun {
  Device device;
  TrainedAvatar avatar;
  std::unique_ptr<Capture> capture;  ///< at the run's image scale, registered as training knew it

  /// Throws Error for what cannot be opened.
  DrivenRun(const std::filesystem::path& run, const std::filesystem::path& data, const CaptureChoice& capture_choice,
            const DeviceChoice& device_choice);
};

}  // namespace degas
