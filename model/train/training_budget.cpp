#include "model/train/training_budget.h"

#include <algorithm>

namespace degas {

BudgetClock::BudgetClock(const TrainingBudget& budget, int64_t step, double minutes)
    : budget_(budget), first_step_(step), step_(step), minutes_before_(minutes) {}

void BudgetClock::count_step() {
  if (step_++ == first_step_) first_step_end_ = Clock::now();
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

double BudgetClock::planned_steps() const {
  const auto iterations = static_cast<double>(budget_.iterations);
  if (!budget_.minutes || step_ < first_step_ + 2) return iterations;
  const double seconds = std::chrono::duration<double>(Clock::now() - first_step_end_).count();
  const double pace = static_cast<double>(step_ - first_step_ - 1) / seconds;
  return std::min(iterations, static_cast<double>(step_) + pace * 60 * std::max(0.0, *budget_.minutes - minutes()));
}

}  // namespace degas
