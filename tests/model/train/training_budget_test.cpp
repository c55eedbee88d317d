#include "model/train/training_budget.h"

#include <thread>

#include "tests/support/catch.h"

using namespace degas;

TEST_CASE("a budget in steps is what it says") {
  BudgetClock clock({20}, 5, 0);
  CHECK(clock.fraction() == 0.25);
  for (int step = 0; step < 3; ++step) clock.count_step();
  CHECK(clock.fraction() == 0.4);
}

TEST_CASE("a budget in minutes counts those of earlier calls") {
  using namespace std::chrono_literals;
  BudgetClock clock({1000, 2.0 / 60}, 0, 1.9 / 60);
  CHECK(clock.fraction() >= 0.95);
  std::this_thread::sleep_for(100ms);
  CHECK(clock.seconds() >= 0.1);
  CHECK(clock.minutes() >= 2.0 / 60);
  CHECK(clock.fraction() >= 1);
}

TEST_CASE("a budget in minutes and steps ends with whichever is reached first") {
  BudgetClock clock({4, 1e6}, 3, 0);
  CHECK(clock.fraction() == 0.75);
  clock.count_step();
  CHECK(clock.fraction() == 1);
}
