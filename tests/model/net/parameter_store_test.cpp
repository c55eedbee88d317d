#include "model/net/parameter_store.h"

#include <cmath>

#include "tests/support/catch.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("initial values follow seed and name, within their bound") {
  Device& device = test::device(KernelSet::Wide);
  ParameterStore first(device, 1), same(device, 1), other(device, 2);
  const std::vector<double> values = first.create_uniform("a", {50, 40}, 0.5).to_host<double>();
  same.create_zeros("earlier", {3});
  CHECK(same.create_uniform("a", {50, 40}, 0.5).to_host<double>() == values);
  CHECK(other.create_uniform("a", {50, 40}, 0.5).to_host<double>() != values);
  CHECK(first.create_uniform("b", {50, 40}, 0.5).to_host<double>() != values);
  double sum = 0, square = 0;
  for (const double value : values) {
    REQUIRE(std::abs(value) <= 0.5);
    sum += value;
    square += value * value;
  }
  CHECK(std::abs(sum / 2000) < 4 * 0.5 / std::sqrt(3.0 * 2000));
  CHECK(square / 2000 == Approx(0.25 / 3).epsilon(0.1));
  const std::vector<double> gain = first.create_gain("gain", "a", 7).to_host<double>();
  CHECK(gain == std::vector<double>(7, static_cast<float>(std::sqrt(square))));
  CHECK(first.count() == 4007);
  CHECK_THROWS_AS(first.create_zeros("a", {1}), std::logic_error);
  CHECK_THROWS_AS(first.find("missing"), std::logic_error);
}

TEST_CASE("normal numbers are normal, and the same for the same seed") {
  const std::vector<float> values = normal_numbers(9, 20000);
  CHECK(values == normal_numbers(9, 20000));
  CHECK(values != normal_numbers(10, 20000));
  double sum = 0, square = 0;
  int beyond = 0;
  for (const float value : values) {
    sum += value;
    square += value * value;
    beyond += std::abs(value) > 1.96F;
  }
  CHECK(std::abs(sum / 20000) < 0.03);
  CHECK(square / 20000 == Approx(1).epsilon(0.04));
  CHECK(beyond / 20000.0 == Approx(0.05).margin(0.007));
}
