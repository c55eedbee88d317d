#pragma once

#include <filesystem>
#include <optional>

#include "model/train/run_lock.h"
#include "model/train/trainer.h"

namespace degas {

/// A run folder opened for training: every input checked, the folder locked, made or continued, the trainer on the
/// device.
class TrainingRun {
 public:
  /// resume: goes on from the folder's checkpoint, and starts anew where there is none. Wrong names and missing codes
  /// are refused before anything is written. Throws Error also where the folder holds a run that may not go on: without
  /// `resume`, with another body, configuration or capture, or while another process trains it. tune: without one, a
  /// tuned run goes on as it was, so that the bits do not change.
  TrainingRun(Device& device, const Config& config, const Capture& capture, const std::filesystem::path& folder,
              const std::filesystem::path& body, bool resume, std::optional<TuneMode> tune = {});

  bool continues() const { return continues_; }
  const RunFolder& folder() const { return folder_; }
  Trainer& trainer() { return trainer_; }

 private:
  RunFolder folder_;
  RunLock lock_;
  bool continues_;
  Trainer trainer_;
};

}  // namespace degas
