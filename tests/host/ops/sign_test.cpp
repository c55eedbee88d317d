#include "host/ops/sign.h"

#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("packed signs take a gradient back through a leaky ReLU") {
  const auto set = GENERATE(from_range(kernel_sets()));
  const auto real = GENERATE(Real::Float, Real::Double);
  const int64_t size = GENERATE(1, 15, 16, 17, 1000);
  Device& device = test::device(set, real);
  std::vector<double> values = random_values(size, 1);
  values[size / 2] = 0;
  const Tensor output = Tensor::from(device, {size}, std::span<const double>(values));
  const Tensor gradient = random_tensor(device, {size}, 2);
  std::vector<double> expected = gradient.to_host<double>();
  for (int64_t i = 0; i < size; ++i) expected[i] *= values[i] > 0 ? 1 : 0.25;
  const Tensor signs = pack_signs(output), target(device, {size});
  leaky_relu_gradient(gradient, signs, 0.25, target);
  CHECK(target.to_host<double>() == expected);
  leaky_relu_gradient(gradient, signs, 0.25, gradient);
  CHECK(gradient.to_host<double>() == expected);
}
