#pragma once

#include <limits>
#include <sstream>

#include "model/train/run_folder.h"
#include "model/train/trainer.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

namespace degas::test {

inline Device& wide() {
  return device(KernelSet::Wide);
}

inline void ignore(const TrainingReport&) {}

inline TrainingBudget budget_of(int64_t iterations) {
  TrainingBudget budget;
  budget.iterations = iterations;
  return budget;
}

/// The lines of a run's history.jsonl.
inline std::vector<nlohmann::json> history_of(const RunFolder& run) {
  std::vector<nlohmann::json> lines;
  std::istringstream stream(file_text(run.history_file()));
  for (std::string line; std::getline(stream, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

/// Steps until `stop_at` (or the end of the config's iterations).
inline TrainingEnd train(Trainer& trainer, const Config& config,
                         int64_t stop_at = std::numeric_limits<int64_t>::max()) {
  TrainingBudget budget = budget_of(config.train.iterations);
  budget.stop_requested = [&] { return trainer.step() >= stop_at; };
  return trainer.run(budget, ignore);
}

/// Mean photometric loss of a training's last twelve reports.
inline double mean_of_last_losses(const std::vector<TrainingReport>& reports) {
  double sum = 0;
  for (auto report = reports.end() - 12; report != reports.end(); ++report) sum += report->losses.at("l1_ssim");
  return sum / 12;
}

/// A head's bias, (R,R,channels), of which one channel is changed at every `stride`-th texel: how training that has
/// gone astray is staged.
class HeadBias {
 public:
  HeadBias(const Trainer& trainer, const std::string& head, int channel, size_t stride = 1)
      : values_(trainer.avatar().network().parameters().find(head + ".bias")), channel_(channel), stride_(stride) {}

  void add(double amount) {
    std::vector<float> numbers = values_.to_host<float>();
    for (size_t i = channel_; i < numbers.size(); i += step()) numbers[i] += static_cast<float>(amount);
    values_.upload(std::span<const float>(numbers));
  }
  /// Of the changed texels.
  std::vector<float> values() const {
    const std::vector<float> numbers = values_.to_host<float>();
    std::vector<float> chosen;
    for (size_t i = channel_; i < numbers.size(); i += step()) chosen.push_back(numbers[i]);
    return chosen;
  }

 private:
  size_t step() const { return static_cast<size_t>(values_.dim(-1)) * stride_; }

  Tensor values_;
  size_t channel_, stride_;
};

}  // namespace degas::test
