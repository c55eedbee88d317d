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
  int skipped = 0;                        ///< non-finite steps so far
  std::string skip_cause;                 ///< of the last one, where one was skipped since the last report
  int64_t dead_texels = 0;                ///< of this step's frame: too faint, small or large to be drawn at all
  double learning_rate = 0;
};

/// A line of history.jsonl.
nlohmann::json history_line(const TrainingReport& report);

/// Gaussians that no picture would show, and so none can bring back. opacities: (N); log_scales: (N,3).
int64_t count_dead(const Tensor& opacities, const Tensor& log_scales);

}  // namespace degas
