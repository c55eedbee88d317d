#pragma once

#include <limits>

#include "model/train/trainer.h"
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

/// Steps until `stop_at` (or the end of the config's iterations).
inline TrainingEnd train(Trainer& trainer, const Config& config,
                         int64_t stop_at = std::numeric_limits<int64_t>::max()) {
  TrainingBudget budget = budget_of(config.train.iterations);
  budget.stop_requested = [&] { return trainer.step() >= stop_at; };
  return trainer.run(budget, ignore);
}

}  // namespace degas::test
