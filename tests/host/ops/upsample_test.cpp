#include "host/ops/upsample.h"

#include <cmath>

#include "host/autograd/gradient_check.h"
#include "host/ops/pointwise.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("upsample equals bilinear interpolation with aligned corners") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Shape shape =
      GENERATE(Shape{1, 1, 1, 3}, Shape{2, 3, 5, 17}, Shape{1, 4, 4, 24}, Shape{1, 1, 7, 16}, Shape{1, 16, 9, 4});
  const Tensor input = random_tensor(device, shape, 1);
  const std::vector<double> x = input.to_host<double>();
  const int64_t height = shape[1], width = shape[2], channels = shape[3];
  const auto at = [&](int64_t n, int64_t row, int64_t column, int64_t c) {
    row = std::min(row, height - 1);
    column = std::min(column, width - 1);
    return x[((n * height + row) * width + column) * channels + c];
  };
  std::vector<double> expected;
  for (int64_t n = 0; n < shape[0]; ++n) {
    for (int64_t i = 0; i < 2 * height; ++i) {
      for (int64_t j = 0; j < 2 * width; ++j) {
        const double v = static_cast<double>(i * (height - 1)) / (2 * height - 1);
        const double u = static_cast<double>(j * (width - 1)) / (2 * width - 1);
        const auto top = static_cast<int64_t>(v + 1e-12), left = static_cast<int64_t>(u + 1e-12);
        const double down = v - top, right = u - left;
        for (int64_t c = 0; c < channels; ++c) {
          expected.push_back((1 - down) * ((1 - right) * at(n, top, left, c) + right * at(n, top, left + 1, c)) +
                             down * ((1 - right) * at(n, top + 1, left, c) + right * at(n, top + 1, left + 1, c)));
        }
      }
    }
  }
  Tape tape(device, false);
  const Tensor output = upsample(tape, input);
  CHECK(output.shape() == Shape{shape[0], 2 * height, 2 * width, channels});
  CHECK(largest_difference(output.to_host<double>(), expected) < 1e-6);
}

TEST_CASE("upsample's gradient passes finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const Shape shape =
      GENERATE(Shape{1, 1, 1, 3}, Shape{2, 3, 5, 8}, Shape{1, 2, 2, 16}, Shape{1, 1, 7, 5}, Shape{1, 12, 9, 4});
  const Tensor input = random_tensor(device, shape, 1).set_requires_gradient();
  const auto function = [](Tape& tape, const std::vector<Tensor>& in) { return std::vector{upsample(tape, in[0])}; };
  CHECK(gradient_check(device, function, {input}) < 1e-6);
}

TEST_CASE("add_upsampled is the sum of its base and what upsample gives, gradients too") {
  const KernelSet set = GENERATE(from_range(kernel_sets()));
  const Shape shape = GENERATE(Shape{1, 1, 1, 3}, Shape{2, 3, 5, 8}, Shape{1, 7, 4, 48});
  const Shape twice{shape[0], 2 * shape[1], 2 * shape[2], shape[3]};
  {
    Device& device = test::device(set);
    const Tensor input = random_tensor(device, shape, 1), base = random_tensor(device, twice, 2);
    Tape tape(device, false);
    CHECK(add_upsampled(tape, base, input).to_host<float>() ==
          add(tape, base, upsample(tape, input)).to_host<float>());
    CHECK_THROWS_AS(add_upsampled(tape, input, input), std::logic_error);
  }
  Device& device = test::device(set, Real::Double);
  const Tensor input = random_tensor(device, shape, 1).set_requires_gradient();
  const Tensor base = random_tensor(device, twice, 2).set_requires_gradient();
  const auto function = [](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{add_upsampled(tape, in[0], in[1])};
  };
  CHECK(gradient_check(device, function, {base, input}) < 1e-6);
}

TEST_CASE("an enlarged map that a backward pass reads is not kept but made anew, to the same bits") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Tensor input = random_tensor(device, {1, 5, 6, 8}, 1).set_requires_gradient();
  Tape tape(device);
  const Tensor output = upsample(tape, input), kept = output.kept();
  CHECK_THROWS_AS(kept.memory(), std::logic_error);
  CHECK(kept.rebuilt().to_host<float>() == output.to_host<float>());
  CHECK(output.rebuilt().to_host<float>() == output.to_host<float>());
  const Tensor reshaped = output.reshaped({10, 12, 8});
  CHECK(reshaped.kept().to_host<float>() == output.to_host<float>());
}
