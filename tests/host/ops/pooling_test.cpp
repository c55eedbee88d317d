#include "host/ops/pooling.h"

#include <algorithm>
#include <cmath>

#include "host/autograd/gradient_check.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("max pooling equals the plain loop") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Shape shape = GENERATE(Shape{1, 3, 3, 1}, Shape{2, 4, 9, 5}, Shape{1, 8, 7, 16}, Shape{2, 11, 6, 35});
  const bool ceil_mode = GENERATE(false, true);
  const int window = GENERATE(2, 3);
  Tape tape(device, false);
  const Tensor input = random_tensor(device, shape, 1);
  const std::vector<double> values = input.to_host<double>();
  const Tensor output = max_pool(tape, input, ceil_mode, window);
  const auto out_side = [&](int64_t side) {
    return static_cast<int64_t>(ceil_mode ? std::ceil((side - window) / 2.0) : std::floor((side - window) / 2.0)) + 1;
  };
  REQUIRE(output.shape() == Shape{shape[0], out_side(shape[1]), out_side(shape[2]), shape[3]});
  std::vector<double> expected;
  for (int64_t n = 0; n < shape[0]; ++n) {
    for (int64_t y = 0; y < output.dim(1); ++y) {
      for (int64_t x = 0; x < output.dim(2); ++x) {
        for (int64_t c = 0; c < shape[3]; ++c) {
          double best = -INFINITY;
          for (int64_t v = 2 * y; v < std::min(2 * y + window, shape[1]); ++v) {
            for (int64_t u = 2 * x; u < std::min(2 * x + window, shape[2]); ++u) {
              best = std::max(best, values[((n * shape[1] + v) * shape[2] + u) * shape[3] + c]);
            }
          }
          expected.push_back(best);
        }
      }
    }
  }
  CHECK(output.to_host<double>() == expected);
}

TEST_CASE("the gradient of max pooling passes finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const Shape shape = GENERATE(Shape{2, 4, 9, 3}, Shape{1, 7, 6, 17});
  const bool ceil_mode = GENERATE(false, true);
  const int window = GENERATE(2, 3);
  const Tensor input = random_tensor(device, shape, 1).set_requires_gradient();
  const auto function = [=](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{max_pool(tape, in[0], ceil_mode, window)};
  };
  CHECK(gradient_check(device, function, {input}) < 1e-6);
}

TEST_CASE("of equal values the first has the whole gradient") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Tensor input = Tensor::zeros(device, {1, 3, 3, 1}).set_requires_gradient();
  Tape tape(device);
  tape.backward(max_pool(tape, input, false));
  CHECK(input.gradient().to_host<double>() == std::vector<double>{1, 0, 0, 0, 0, 0, 0, 0, 0});
}

TEST_CASE("max pooling refuses sides below its window") {
  Device& device = test::device(KernelSet::Wide);
  Tape tape(device);
  CHECK_THROWS_AS(max_pool(tape, random_tensor(device, {1, 2, 5, 4}, 1), true), std::logic_error);
  CHECK_THROWS_AS(max_pool(tape, random_tensor(device, {1, 9, 9, 4}, 1), true, 4), std::logic_error);
}
