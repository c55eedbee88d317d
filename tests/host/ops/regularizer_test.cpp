#include "host/ops/regularizer.h"

#include <cmath>

#include "host/autograd/gradient_check.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("mean length of rows, with a safe gradient at zero") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Tensor rows =
      Tensor::from(device, {4, 3}, std::span<const double>(std::vector<double>{3, 4, 0, 0, 0, 0, 0, 0, -2, 1, 2, 2}))
          .set_requires_gradient();
  Tape tape(device);
  const Tensor length = mean_length(tape, rows);
  tape.backward(length);
  CHECK(length.to_host<double>()[0] == Approx(2.5));
  const std::vector<double> expected{0.15, 0.2, 0, 0, 0, 0, 0, 0, -0.25, 1 / 12.0, 1 / 6.0, 1 / 6.0};
  CHECK(largest_difference(rows.gradient().to_host<double>(), expected) < 1e-6);
}

TEST_CASE("excess_scale averages the scales above ten times their base") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const std::vector<double> base{std::log(0.01), std::log(0.01), std::log(0.02), std::log(1e-4)};
  const auto run = [&](const std::vector<double>& scales, std::vector<double>* gradient) {
    std::vector<double> logs;
    for (double s : scales) logs.push_back(std::log(s));
    const Tensor log_scales = Tensor::from(device, {4}, std::span<const double>(logs)).set_requires_gradient();
    Tape tape(device);
    const Tensor loss = excess_scale(tape, log_scales, Tensor::from(device, {4}, std::span<const double>(base)), 10);
    tape.backward(loss);
    *gradient = log_scales.gradient().to_host<double>();
    return loss.to_host<double>()[0];
  };
  std::vector<double> gradient;
  CHECK(run({0.5, 0.09, 0.3, 9e-4}, &gradient) == Approx(0.4).epsilon(1e-5));
  CHECK(largest_difference(gradient, {0.25, 0, 0.15, 0}) < 1e-6);
  CHECK(run({0.01, 0.09, 0.1, 1e-4}, &gradient) == 0);
  CHECK(gradient == std::vector<double>{0, 0, 0, 0});
  CHECK(std::isnan(run({NAN, 0.09, 0.1, 1e-4}, &gradient)));
}

TEST_CASE("mean_shortfall pulls what lies below the floor, however far, and nothing else") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const auto run = [&](const std::vector<double>& numbers, std::vector<double>* gradient) {
    const Tensor values = Tensor::from(device, {4}, std::span<const double>(numbers)).set_requires_gradient();
    Tape tape(device);
    const Tensor loss = mean_shortfall(tape, values, -5);
    tape.backward(loss);
    *gradient = values.gradient().to_host<double>();
    return loss.to_host<double>()[0];
  };
  std::vector<double> gradient;
  CHECK(run({-8, -5, 3, -105}, &gradient) == Approx(103 / 4.0));
  CHECK(gradient == std::vector<double>{-0.25, 0, 0, -0.25});
  CHECK(run({-4, -5, 3, 90}, &gradient) == 0);
  CHECK(gradient == std::vector<double>{0, 0, 0, 0});
  CHECK(std::isnan(run({NAN, -5, 3, 90}, &gradient)));

  // With a base the floor differs from element to element.
  const std::vector<double> numbers = {1, 2, 3}, bases = {0, 4, 6};
  const Tensor values = Tensor::from(device, {3}, std::span<const double>(numbers)).set_requires_gradient();
  const Tensor base = Tensor::from(device, {3}, std::span<const double>(bases));
  Tape tape(device);
  const Tensor loss = mean_shortfall(tape, values, -1, base);
  tape.backward(loss);
  CHECK(loss.to_host<double>()[0] == Approx(1));
  CHECK(largest_difference(values.gradient().to_host<double>(), {0, -1 / 3.0, -1 / 3.0}) < 1e-6);
  CHECK_THROWS_AS(mean_shortfall(tape, values, -1, random_tensor(device, {4}, 1)), std::logic_error);
}

TEST_CASE("gradients of the regularisers pass finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const int64_t rows = GENERATE(1, 5, 1031);
  const Tensor offsets = random_tensor(device, {rows, 3}, 1).set_requires_gradient();
  const Tensor log_scales = random_tensor(device, {rows, 3}, 2, -4, 4).set_requires_gradient();
  const Tensor base = random_tensor(device, {rows, 3}, 3, -2, -1);
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{mean_length(tape, in[0]), excess_scale(tape, in[1], base, 10)};
  };
  CHECK(gradient_check(device, function, {offsets, log_scales}, {.samples_per_input = 20}) < 1e-6);
  const auto shortfalls = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{mean_shortfall(tape, in[0], -1), mean_shortfall(tape, in[0], 1, base)};
  };
  CHECK(gradient_check(device, shortfalls, {log_scales}, {.samples_per_input = 20}) < 1e-6);
}

TEST_CASE("the gate lets a value and its gradient through below the limit only") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const auto number = [&](double value) { return Tensor::from(device, {1}, std::span<const double>(&value, 1)); };
  for (const bool open : {true, false}) {
    const Tensor value = number(5).set_requires_gradient(), control = number(open ? 0.1 : 0.11).set_requires_gradient();
    Tape tape(device);
    const Tensor output = gate(tape, value, control, 0.1);
    tape.backward(output);
    CHECK(output.to_host<double>()[0] == (open ? 5 : 0));
    CHECK(value.gradient().to_host<double>()[0] == (open ? 1 : 0));
    CHECK_FALSE(control.has_gradient());
  }
}
