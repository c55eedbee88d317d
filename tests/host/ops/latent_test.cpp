#include "host/ops/latent.h"

#include <cmath>

#include "host/autograd/gradient_check.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("latent sampling and divergence equal their formulas") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const int64_t count = GENERATE(1, 17, 130);
  const Tensor mean = random_tensor(device, {1, count}, 1), spread = random_tensor(device, {1, count}, 2);
  const Tensor noise = random_tensor(device, {1, count}, 3, -2, 2);
  const std::vector<double> m = mean.to_host<double>(), s = spread.to_host<double>(), e = noise.to_host<double>();
  std::vector<double> code(count), divergence(count);
  for (int64_t i = 0; i < count; ++i) {
    code[i] = m[i] + std::exp(s[i]) * e[i];
    divergence[i] = (m[i] * m[i] + std::exp(2 * s[i]) - 1) / 2 - s[i];
  }
  Tape tape(device, false);
  CHECK(largest_difference(sample_latent(tape, mean, spread, noise).to_host<double>(), code) < 1e-6);
  CHECK(largest_difference(unit_divergence(tape, mean, spread).to_host<double>(), divergence) < 1e-6);
}

TEST_CASE("a unit Gaussian has no divergence from itself") {
  Device& device = test::device(KernelSet::Wide, Real::Double);
  Tape tape(device, false);
  const Tensor zeros = Tensor::zeros(device, {1, 5});
  CHECK(unit_divergence(tape, zeros, zeros).to_host<double>() == std::vector<double>(5, 0.0));
}

TEST_CASE("latent gradients pass finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const Tensor mean = random_tensor(device, {1, 33}, 1).set_requires_gradient();
  const Tensor spread = random_tensor(device, {1, 33}, 2).set_requires_gradient();
  const Tensor noise = random_tensor(device, {1, 33}, 3);
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{sample_latent(tape, in[0], in[1], noise), unit_divergence(tape, in[0], in[1])};
  };
  CHECK(gradient_check(device, function, {mean, spread}) < 1e-6);
}
