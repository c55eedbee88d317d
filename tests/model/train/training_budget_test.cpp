#include "model/train/training_budget.h"

#include <thread>

#include "tests/support/catch.h"

using namespace degas;

TEST_CASE("a budget in steps is what it says") {
  BudgetClock clock({20}, 5, 0);
  CHECK(clock.fraction() == 0.25);
  CHECK(clock.planned_steps() == 20);
  clock.count_step();
  clock.count_step();
  clock.count_step();
  CHECK(clock.fraction() == 0.4);
  CHECK(clock.planned_steps() == 20);
}

TEST_CASE("a budget in minutes plans the steps that its rest allows at the pace after the first step") {
  using namespace std::chrono_literals;
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const double minutes = 2.0 / 60;
  BudgetClock clock({1000, minutes}, 0, minutes / 2);
  CHECK(clock.fraction() >= 0.5);
  CHECK(clock.planned_steps() == 1000);
  const auto before_first = now();
  clock.count_step();  // says nothing of the pace
  const auto after_first = now();
  CHECK(clock.planned_steps() == 1000);
  for (int step = 0; step < 4; ++step) {
    std::this_thread::sleep_for(20ms);
    clock.count_step();
  }
  // Between what a little less time and a little more would have made of it.
  const auto planned = [&](auto first_step_end, auto at, double minutes_spent) {
    const double pace = 4 / std::chrono::duration<double>(at - first_step_end).count();
    return 5 + pace * 60 * std::max(0.0, minutes - minutes_spent);
  };
  const double most = planned(after_first, now(), clock.minutes());
  const double steps = clock.planned_steps();
  CHECK(steps <= most * (1 + 1e-9));
  CHECK(steps >= planned(before_first, now(), clock.minutes()) * (1 - 1e-9));
  CHECK(clock.minutes() >= 1.08 / 60);
  std::this_thread::sleep_for(1s);
  CHECK(clock.fraction() >= 1);
  CHECK(clock.planned_steps() == 5);
}

TEST_CASE("a budget in minutes and steps ends with whichever is reached first") {
  BudgetClock clock({4, 1e6}, 3, 0);
  CHECK(clock.fraction() == 0.75);
  clock.count_step();
  CHECK(clock.fraction() == 1);
}
