#include "host/ops/pointwise.h"

#include "host/autograd/gradient_check.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("pointwise operations equal the plain loops") {
  const auto set = GENERATE(from_range(kernel_sets()));
  const int64_t count = GENERATE(1, 15, 16, 17, 1031);
  Device& device = test::device(set);
  Tape tape(device, false);
  const Tensor a = random_tensor(device, {count}, 1), b = random_tensor(device, {count}, 2);
  const std::vector<double> x = a.to_host<double>(), y = b.to_host<double>();
  std::vector<double> total(count), product(count), scaled(count);
  for (int64_t i = 0; i < count; ++i) {
    total[i] = x[i] + y[i];
    product[i] = x[i] * y[i];
    scaled[i] = 2.5 * x[i] - 1;
  }
  CHECK(largest_difference(add(tape, a, b).to_host<double>(), total) < 1e-6);
  CHECK(largest_difference(multiply(tape, a, b).to_host<double>(), product) < 1e-6);
  CHECK(largest_difference(scale(tape, a, 2.5, -1).to_host<double>(), scaled) < 1e-6);
}

TEST_CASE("pointwise gradients pass finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const Tensor a = random_tensor(device, {3, 7}, 1).set_requires_gradient();
  const Tensor b = random_tensor(device, {3, 7}, 2).set_requires_gradient();
  const auto function = [](Tape& tape, const std::vector<Tensor>& in) {
    // `a` is used twice, so accumulation is checked too.
    return std::vector{add(tape, multiply(tape, in[0], in[1]), scale(tape, in[0], -3, 1))};
  };
  CHECK(gradient_check(device, function, {a, b}) < 1e-6);
}
