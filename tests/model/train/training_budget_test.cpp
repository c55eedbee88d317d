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
  BudgetClock clock({1000, 2.0 / 60}, 0, 1.0 / 60);  // one second of two is spent
  CHECK(clock.fraction() >= 0.5);
  CHECK(clock.planned_steps() == 1000);
  clock.count_step();  // says nothing of the pace
  CHECK(clock.planned_steps() == 1000);
  for (int step = 0; step < 4; ++step) {
    std::this_thread::sleep_for(20ms);
    clock.count_step();
  }
  CHECK(clock.planned_steps() >= 5);
  CHECK(clock.planned_steps() <= 5 + 50);  // each step took 20 ms at least, and less than a second is left
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
