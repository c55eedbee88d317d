#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "host/autograd/tensor.h"

namespace degas {

/// What one line of history.jsonl holds, and what the progress bar shows.
struct TrainingReport {
  int64_t step = 0;
  double fraction = 0;                    ///< of the budget: iterations or minutes, whichever is further
  double seconds = 0;                     ///< of training in this call
  double steps_per_second = 0;            ///< since the last report
  std::map<std::string, double> losses;   ///< "loss" and its terms, of this step
  std::optional<double> validation_psnr;  ///< dB, where one was made since the last report
  double gradient_norm = 0;               ///< of this step, before clipping
  int skipped = 0;                        ///< steps so far: spikes and those without a finite gradient
  std::string skip_cause;                 ///< of the last one, where one was skipped since the last report
  int64_t dead_texels = 0;                ///< of this step's frame: too faint, small or large to be drawn at all
  int64_t exploded_texels = 0;            ///< of the same: a scale beyond loss.scale_limit times its base
  double learning_rate = 0;
};

/// A line of history.jsonl.
nlohmann::json history_line(const TrainingReport& report);

struct TexelFaults {
  int64_t dead = 0;      ///< no picture would show it, and so none can bring it back
  int64_t exploded = 0;  ///< a scale is beyond scale_limit times its base
};
/// opacities: (N); log_scales and base_log_scales: (N,3). Waits for the device.
TexelFaults count_faults(const Tensor& opacities, const Tensor& log_scales, const Tensor& base_log_scales,
                         double scale_limit);

}  // namespace degas
