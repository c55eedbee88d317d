#include "host/ops/image.h"

#include "host/autograd/gradient_check.h"
#include "host/io/npz.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("compositing puts the premultiplied foreground over the background") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const std::vector<uint8_t> color{255, 128, 0, 0, 0, 0, 51, 0, 51}, mask{255, 0, 51};
  const Tensor image = composite(Tensor::from(device, {1, 3, 3}, std::span<const uint8_t>(color)),
                                 Tensor::from(device, {1, 3}, std::span<const uint8_t>(mask)), {1, 0.5, 0.25});
  const std::vector<double> expected{1, 128 / 255.0, 0, 1, 0.5, 0.25, 1, 0.4, 0.4};
  CHECK(image.shape() == Shape{1, 3, 3});
  CHECK(largest_difference(image.to_host<double>(), expected) < 1e-6);
}

TEST_CASE("a crop is the rectangle, with a colour where the image ends") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Rectangle r =
      GENERATE(Rectangle{0, 0, 5, 4}, Rectangle{1, 2, 3, 1}, Rectangle{-2, -1, 9, 7}, Rectangle{7, 7, 2, 2});
  const Tensor image = random_tensor(device, {4, 5, 3}, 1);
  const std::vector<double> values = image.to_host<double>();
  const std::array<double, 3> outside{0.25, 0.5, 0.75};
  std::vector<double> expected;
  for (int y = r.top; y < r.top + r.height; ++y) {
    for (int x = r.left; x < r.left + r.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        expected.push_back(y >= 0 && y < 4 && x >= 0 && x < 5 ? values[(y * 5 + x) * 3 + c] : outside[c]);
      }
    }
  }
  Tape tape(device, false);
  CHECK(crop(tape, image, r, outside).to_host<double>() == expected);
}

TEST_CASE("resizing equals torch: area where an axis shrinks, linear where it grows") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const NpzFile file(std::string(DEGAS_TEST_VECTORS) + "/resize.npz");
  const NpyArray image = file.read("image");
  const std::string name = GENERATE("shrunk", "halved", "grown", "same");
  const NpyArray expected = file.read(name);
  Tape tape(device, false);
  const Tensor input = Tensor::from(device, image.shape, std::span<const double>(image.doubles()));
  const Tensor output = resize(tape, input, static_cast<int>(expected.shape[0]), static_cast<int>(expected.shape[1]));
  CHECK(output.shape() == expected.shape);
  CHECK(largest_difference(output.to_host<double>(), expected.doubles()) < 1e-6);
}

TEST_CASE("gradients of crop and resize pass finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const Tensor image = random_tensor(device, {9, 7, 3}, 1).set_requires_gradient();
  const auto function = [](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{crop(tape, in[0], {-1, 2, 6, 9}, {0, 0, 1}), resize(tape, in[0], 4, 5),
                       resize(tape, in[0], 20, 3), resize(tape, in[0], 1, 31)};
  };
  CHECK(gradient_check(device, function, {image}, {.samples_per_input = 40}) < 1e-6);
}
