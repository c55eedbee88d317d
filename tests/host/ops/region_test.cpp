#include "host/ops/region.h"

#include "host/autograd/gradient_check.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

/// Every element of an image (N, H, W, C) by its place.
template <typename Element>
std::vector<double> image_of(const Shape& shape, const Element& element) {
  std::vector<double> values;
  for (int64_t n = 0; n < shape[0]; ++n) {
    for (int64_t y = 0; y < shape[1]; ++y) {
      for (int64_t x = 0; x < shape[2]; ++x) {
        for (int64_t c = 0; c < shape[3]; ++c) values.push_back(element(n, y, x, c));
      }
    }
  }
  return values;
}

double at(const std::vector<double>& values, const Shape& shape, int64_t n, int64_t y, int64_t x, int64_t c) {
  return values[((n * shape[1] + y) * shape[2] + x) * shape[3] + c];
}

}  // namespace

TEST_CASE("tile_masked multiplies every pixel's copy of the values by its mask") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Tensor values = random_tensor(device, {2, 19}, 1), mask = random_tensor(device, {3, 5, 19}, 2);
  const std::vector<double> v = values.to_host<double>(), m = mask.to_host<double>();
  Tape tape(device, false);
  const Tensor output = tile_masked(tape, values, mask);
  const auto expected = image_of({2, 3, 5, 19}, [&](int64_t n, int64_t y, int64_t x, int64_t c) {
    return v[n * 19 + c] * m[(y * 5 + x) * 19 + c];
  });
  CHECK(largest_difference(output.to_host<double>(), expected) < 1e-6);
}

TEST_CASE("overwrite_region puts the patch's first channels into the rectangle") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const int first = GENERATE(0, 3);
  const Shape base_shape{2, 5, 7, 18}, patch_shape{2, 2, 3, 17};
  const Tensor base = random_tensor(device, base_shape, 1), patch = random_tensor(device, patch_shape, 2);
  const std::vector<double> b = base.to_host<double>(), p = patch.to_host<double>();
  Tape tape(device, false);
  const Tensor output = overwrite_region(tape, base, patch, 1, 4, first);
  const auto expected = image_of(base_shape, [&](int64_t n, int64_t y, int64_t x, int64_t c) {
    const bool inside = y >= 1 && y < 3 && x >= 4 && x < 7 && c >= first && c < first + 17;
    return inside ? at(p, patch_shape, n, y - 1, x - 4, c - first) : at(b, base_shape, n, y, x, c);
  });
  CHECK(output.to_host<double>() == expected);
  CHECK_THROWS_AS(overwrite_region(tape, base, patch, 4, 0), std::logic_error);
}

TEST_CASE("channels are concatenated, split and repeated in order") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Shape small{1, 3, 3, 5}, large{1, 3, 3, 33};
  const Tensor a = random_tensor(device, small, 1), b = random_tensor(device, large, 2);
  const std::vector<double> x = a.to_host<double>(), y = b.to_host<double>();
  Tape tape(device, false);
  const Tensor joined = concat_channels(tape, {a, b});
  CHECK(joined.to_host<double>() == image_of({1, 3, 3, 38}, [&](int64_t n, int64_t i, int64_t j, int64_t c) {
          return c < 5 ? at(x, small, n, i, j, c) : at(y, large, n, i, j, c - 5);
        }));
  const std::vector<Tensor> parts = split_channels(tape, joined, {5, 33});
  CHECK(parts[0].to_host<double>() == x);
  CHECK(parts[1].to_host<double>() == y);
  CHECK(repeat_channels(tape, a, 3).to_host<double>() ==
        image_of({1, 3, 3, 15},
                 [&](int64_t n, int64_t i, int64_t j, int64_t c) { return at(x, small, n, i, j, c % 5); }));
  CHECK_THROWS_AS(split_channels(tape, joined, {5, 32}), std::logic_error);
}

TEST_CASE("region operations' gradients pass finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const Tensor values = random_tensor(device, {2, 19}, 1).set_requires_gradient();
  const Tensor mask = random_tensor(device, {9, 5, 19}, 2);
  const Tensor base = random_tensor(device, {1, 4, 5, 18}, 3).set_requires_gradient();
  const Tensor patch = random_tensor(device, {1, 2, 3, 17}, 4).set_requires_gradient();
  const auto tiled = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{tile_masked(tape, in[0], mask)};
  };
  CHECK(gradient_check(device, tiled, {values}) < 1e-6);
  const auto overwritten = [](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{overwrite_region(tape, in[0], in[1], 1, 2, 3)};
  };
  CHECK(gradient_check(device, overwritten, {base, patch}) < 1e-6);
  const auto moved = [](Tape& tape, const std::vector<Tensor>& in) {
    const Tensor joined = concat_channels(tape, {in[0], repeat_channels(tape, in[0], 3)});
    // The last part is dropped: its gradient is zero.
    std::vector<Tensor> parts = split_channels(tape, joined, {7, 60, 5});
    return std::vector{parts[0], parts[1]};
  };
  CHECK(gradient_check(device, moved, {base}) < 1e-6);
}
