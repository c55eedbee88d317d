#include "model/train/training_budget.h"

#include <algorithm>

namespace degas {

BudgetClock::BudgetClock(const TrainingBudget& budget, int64_t step, double minutes)
    : budget_(budget), step_(step), minutes_before_(minutes) {}

void BudgetClock::count_step() {
  ++step_;
}

double BudgetClock::seconds() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

double BudgetClock::minutes() const {
  return minutes_before_ + seconds() / 60;
}

double BudgetClock::fraction() const {
  const double by_steps = static_cast<double>(step_) / static_cast<double>(std::max<int64_t>(1, budget_.iterations));
  return budget_.minutes ? std::max(by_steps, minutes() / *budget_.minutes) : by_steps;
}

}  // namespace degas
