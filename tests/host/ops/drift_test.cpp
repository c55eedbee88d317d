#include "host/ops/drift.h"

#include <cmath>

#include "host/autograd/gradient_check.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("mean drift is the length of each group's mean vector, by its rows") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const auto run = [&](std::vector<double> numbers, std::vector<double>* gradient) {
    const Tensor rows = Tensor::from(device, {5, 3}, std::span<const double>(numbers)).set_requires_gradient();
    Tape tape(device);
    const Tensor drift = mean_drift(tape, rows, group_rows(device, {3, 0, 3, 1, 1}, 4));
    tape.backward(drift);
    *gradient = rows.gradient().to_host<double>();
    return drift.to_host<double>()[0];
  };
  // Group 3: (3, 4, 0), group 0: (0, 0, 5), group 1: two that cancel, group 2: none.
  std::vector<double> gradient;
  CHECK(run({1, 8, 0, 0, 0, 5, 5, 0, 0, 1, 2, 3, -1, -2, -3}, &gradient) == Approx((2 * 5 + 1 * 5) / 5.0));
  const std::vector<double> expected = {0.12, 0.16, 0, 0, 0, 0.2, 0.12, 0.16, 0, 0, 0, 0, 0, 0, 0};
  CHECK(largest_difference(gradient, expected) < 1e-6);
  CHECK(std::isnan(run({NAN, 8, 0, 0, 0, 5, 5, 0, 0, 1, 2, 3, -1, -2, -3}, &gradient)));
  CHECK_THROWS_AS(group_rows(device, {0, 4}, 4), std::logic_error);
  CHECK_THROWS_AS(group_rows(device, {-1}, 4), std::logic_error);
  Tape tape(device);
  CHECK_THROWS_AS(mean_drift(tape, random_tensor(device, {4, 3}, 1), group_rows(device, {0}, 1)), std::logic_error);
}

TEST_CASE("the gradient of mean drift passes finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const int64_t rows = GENERATE(1, 5, 1031);
  std::vector<int32_t> group_of_row(static_cast<size_t>(rows));
  for (size_t row = 0; row < group_of_row.size(); ++row) group_of_row[row] = static_cast<int32_t>(row * row % 7);
  const RowGroups groups = group_rows(device, group_of_row, 7);
  const Tensor offsets = random_tensor(device, {rows, 3}, 1).set_requires_gradient();
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{mean_drift(tape, in[0], groups)};
  };
  CHECK(gradient_check(device, function, {offsets}, {.samples_per_input = 20}) < 1e-6);
}
