#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>

namespace degas {

struct TrainingBudget {
  int64_t iterations = 0;         ///< optimiser steps in all, resumed ones included
  std::optional<double> minutes;  ///< of training, those before a resume included
  std::function<bool()> stop_requested = [] { return false; };
};

/// How much of a budget is spent. Starts when it is made.
class BudgetClock {
 public:
  /// step, minutes: those of earlier calls.
  BudgetClock(const TrainingBudget& budget, int64_t step, double minutes);

  /// To be called after each step.
  void count_step();

  double seconds() const;  ///< since the start
  double minutes() const;  ///< those of earlier calls included
  /// Of the budget: iterations or minutes, whichever is further.
  double fraction() const;

 private:
  using Clock = std::chrono::steady_clock;
  TrainingBudget budget_;
  int64_t step_;
  double minutes_before_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace degas
