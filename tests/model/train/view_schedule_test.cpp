#include "model/train/view_schedule.h"

#include <map>
#include <set>

#include "host/random.h"
#include "tests/support/catch.h"

using namespace degas;

TEST_CASE("an epoch visits every frame once, in changing order, and all views equally often") {
  const ViewSchedule schedule({{10, {0, 1, 2, 3, 4, 5}}, {11, {0, 2}}, {15, {1, 2, 3, 4}}}, 2, 7);
  std::map<std::pair<int, int>, int> seen;
  std::set<std::vector<int>> orders;
  constexpr int epochs = 60;
  for (int epoch = 0; epoch < epochs; ++epoch) {
    std::vector<int> order;
    for (int64_t i = 0; i < schedule.steps_per_epoch(); ++i) {
      const LoadRequest plan = schedule.plan(epoch * schedule.steps_per_epoch() + i);
      order.push_back(plan.frame);
      CHECK(plan.cameras.size() == 2);
      for (int camera : plan.cameras) ++seen[{plan.frame, camera}];
    }
    CHECK(std::set<int>(order.begin(), order.end()) == std::set<int>{10, 11, 15});
    orders.insert(order);
  }
  CHECK(orders.size() == 6);
  for (int camera = 0; camera < 6; ++camera) CHECK(seen[{10, camera}] == epochs * 2 / 6);
  CHECK(seen[{11, 0}] == epochs);
  CHECK(seen[{15, 3}] == epochs * 2 / 4);
}

TEST_CASE("a plan depends on seed and step alone") {
  const std::vector<LoadRequest> views = {{0, {0, 1, 2}}, {1, {0, 1, 2}}, {2, {0, 1, 2}}};
  const ViewSchedule a(views, 2, 1), same(views, 2, 1), other(views, 2, 2);
  int differing = 0;
  for (int64_t step : {100, 3, 50, 0, 7, 8, 9, 10}) {
    CHECK(a.plan(step).frame == same.plan(step).frame);
    CHECK(a.plan(step).cameras == same.plan(step).cameras);
    differing += a.plan(step).frame != other.plan(step).frame || a.plan(step).cameras != other.plan(step).cameras;
  }
  CHECK(differing > 0);
}

TEST_CASE("convex weights are convex and vary") {
  Random random = Random::of_step(1, 2, 3);
  double spread = 0;
  for (int i = 0; i < 100; ++i) {
    const std::vector<double> weights = random.convex_weights(4);
    double total = 0;
    for (double weight : weights) {
      CHECK(weight >= 0);
      total += weight;
    }
    CHECK(total == Approx(1));
    spread = std::max(spread, std::abs(weights[0] - 0.25));
  }
  CHECK(spread > 0.3);
}
