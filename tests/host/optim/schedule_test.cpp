#include "host/optim/schedule.h"

#include <catch2/catch.hpp>

using namespace degas;

TEST_CASE("constant rate after a linear warm-up") {
  const Schedule schedule{Schedule::Kind::Constant, 2.0, 0, 4, 0};
  CHECK(schedule.at(0) == Approx(0.5));
  CHECK(schedule.at(2) == Approx(1.5));
  CHECK(schedule.at(3) == Approx(2.0));
  CHECK(schedule.at(1000000) == Approx(2.0));
}

TEST_CASE("half a cosine from the end of warm-up to total_steps") {
  const Schedule schedule{Schedule::Kind::Cosine, 1.0, 0.1, 10, 110};
  CHECK(schedule.at(9) == Approx(1.0));
  CHECK(schedule.at(10) == Approx(1.0));
  CHECK(schedule.at(60) == Approx(0.55));
  CHECK(schedule.at(35) == Approx(0.1 + 0.9 * 0.5 * (1 + std::sqrt(0.5))));
  CHECK(schedule.at(110) == Approx(0.1));
  CHECK(schedule.at(500) == Approx(0.1));
}

TEST_CASE("without warm-up the first step has the peak") {
  CHECK(Schedule{Schedule::Kind::Cosine, 1.0, 0, 0, 100}.at(0) == Approx(1.0));
}
