#include "host/ops/conv2d_winograd.h"

#include <cmath>

#include "host/device/tuner.h"
#include "host/ops/conv2d.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

/// Chooses the gather kernel, with its built-in parameters.
class ChosenKernel : public Tuner {
 public:
  ChosenKernel(Device& device, Conv2dKernel kernel) : Tuner(device, TuneMode::Full, {}), kernel_(kernel) {}

  Parameters choose(const TunedKernel&, const std::string&, const std::function<Tunable()>& describe) override {
    for (const Parameters& candidate : describe().candidates) {
      if (candidate.at("kernel") == static_cast<int>(kernel_)) return candidate;
    }
    FAIL("no such candidate");
    return {};
  }

 private:
  Conv2dKernel kernel_;
};

std::vector<double> convolved(Device& device, Conv2dKernel kernel, const Tensor& input, const Tensor& weight) {
  Tape tape(device, false);
  device.set_tuner(std::make_unique<ChosenKernel>(device, kernel));
  const std::vector<double> result = conv2d(tape, input, weight, Tensor(), {.padding = 1}).to_host<double>();
  device.set_tuner(nullptr);
  return result;
}

/// The gradient with respect to a weight of 3 x 3 taps of sum(output * factor).
std::vector<double> weight_gradient(Device& device, Conv2dKernel kernel, const Tensor& input, const Tensor& factor) {
  const Conv2dGeometry g{static_cast<int>(input.dim(0)),
                         static_cast<int>(input.dim(1)),
                         static_cast<int>(input.dim(2)),
                         static_cast<int>(input.dim(3)),
                         static_cast<int>(factor.dim(1)),
                         static_cast<int>(factor.dim(2)),
                         static_cast<int>(factor.dim(3)),
                         3,
                         1,
                         1,
                         1};
  const Tensor result(device, {1, 3, 3, g.channels, g.output_channels});
  device.set_tuner(std::make_unique<ChosenKernel>(device, kernel));
  conv2d_backward_weight(g, input, factor, result);
  device.set_tuner(nullptr);
  return result.to_host<double>();
}

/// Root of the mean square of the differences, over that of b.
double relative_error(const std::vector<double>& a, const std::vector<double>& b) {
  double squares = 0, all = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    squares += (a[i] - b[i]) * (a[i] - b[i]);
    all += b[i] * b[i];
  }
  return std::sqrt(squares / all);
}

}  // namespace

TEST_CASE("Winograd's filtering equals the plain sums on tiles that reach over the border") {
  Device& device = test::device(KernelSet::Wide);
  const Tensor input = random_tensor(device, {1, 5, 6, 16}, 1), weight = random_tensor(device, {1, 3, 3, 16, 20}, 2);
  CHECK(largest_difference(convolved(device, Conv2dKernel::Winograd, input, weight),
                           convolved(device, Conv2dKernel::Sums, input, weight)) < 1e-5);
  const Tensor factor = random_tensor(device, {1, 5, 6, 32}, 3);
  CHECK(largest_difference(weight_gradient(device, Conv2dKernel::Winograd, input, factor),
                           weight_gradient(device, Conv2dKernel::Sums, input, factor)) < 1e-5);
}

TEST_CASE("Winograd's filtering rounds little worse than plain sums", "[large]") {
  const int depth = GENERATE(16, 64, 128);
  const bool of_weights = GENERATE(false, true);
  const auto result = [=](Real real, Conv2dKernel kernel) {
    Device& device = test::device(KernelSet::Wide, real);
    const Tensor input = random_tensor(device, {1, 32, 32, depth}, 1);
    if (of_weights) return weight_gradient(device, kernel, input, random_tensor(device, {1, 32, 32, depth}, 2));
    return convolved(device, kernel, input, random_tensor(device, {1, 3, 3, depth, 32}, 2));
  };
  const std::vector<double> truth = result(Real::Double, Conv2dKernel::Sums);
  const double sums = relative_error(result(Real::Float, Conv2dKernel::Sums), truth);
  const double winograd = relative_error(result(Real::Float, Conv2dKernel::Winograd), truth);
  INFO(depth << " channels, of weights " << of_weights << ", relative error: sums " << sums << ", Winograd "
             << winograd);
  CHECK(winograd < 4 * sums);
  CHECK(winograd < 2e-6);
  CHECK(relative_error(result(Real::Double, Conv2dKernel::Winograd), truth) < 1e-14);
}

TEST_CASE("Winograd's filtering is for what repays its transforms, where there is room for its points") {
  Device& device = test::device(KernelSet::Wide);
  const auto arguments = [](int size, int depth, int kernel_size, int step) {
    return GatherArguments{.source_height = size,
                           .source_width = size,
                           .source_channels = depth,
                           .target_height = size / step,
                           .target_width = size / step,
                           .target_channels = 32,
                           .batch = 1,
                           .groups = 1,
                           .kernel_size = {kernel_size, kernel_size},
                           .source_step = {step, step},
                           .target_step = {1, 1},
                           .lead = {-1, -1}};
  };
  CHECK(gather_parameters(device, arguments(64, 32, 3, 1)).kernel == Conv2dKernel::Winograd);
  CHECK(gather_parameters(device, arguments(4, 32, 3, 1)).kernel != Conv2dKernel::Winograd);   // four tiles or one
  CHECK(gather_parameters(device, arguments(64, 24, 3, 1)).kernel != Conv2dKernel::Winograd);  // no whole vectors
  CHECK(gather_parameters(device, arguments(64, 32, 5, 1)).kernel != Conv2dKernel::Winograd);
  CHECK(gather_parameters(device, arguments(64, 32, 3, 2)).kernel != Conv2dKernel::Winograd);
  CHECK(gather_parameters(device, arguments(64, 1 << 20, 3, 1)).kernel != Conv2dKernel::Winograd);  // no room
  CHECK(gather_parameters(test::device(KernelSet::Gpu), arguments(64, 32, 3, 1)).kernel == Conv2dKernel::Sums);
}
