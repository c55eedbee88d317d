#include "host/ops/reduction.h"

#include <numeric>

#include "host/autograd/gradient_check.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("sum and mean equal the plain loops") {
  const auto set = GENERATE(from_range(kernel_sets()));
  const int64_t count = GENERATE(1, 16, 17, 1023, 1024, 1025, 1100003);
  Device& device = test::device(set);
  Tape tape(device, false);
  const Tensor input = random_tensor(device, {count}, 1, 0, 1);
  const std::vector<double> values = input.to_host<double>();
  const double expected = std::accumulate(values.begin(), values.end(), 0.0);
  CHECK(sum(tape, input).to_host<double>()[0] == Approx(expected).epsilon(1e-5));
  CHECK(mean(tape, input).to_host<double>()[0] == Approx(expected / static_cast<double>(count)).epsilon(1e-5));
}

TEST_CASE("reduction gradients pass finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const Tensor input = random_tensor(device, {5, 7}, 1).set_requires_gradient();
  const auto function = [](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{sum(tape, in[0]), mean(tape, in[0])};
  };
  CHECK(gradient_check(device, function, {input}) < 1e-6);
}
