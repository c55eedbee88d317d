#include "model/train/picture.h"

#include <cmath>

#include "tests/support/catch.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("rendered values are rounded to nearest and clamped; what is no number is black") {
  const std::vector<float> values = {0, 1,   0.5f,     1.4f / 255, 1.6f / 255,   -3,
                                     7, NAN, INFINITY, -INFINITY,  254.4f / 255, 254.6f / 255};
  const Image8 image = to_image8(Tensor::from(device(KernelSet::Wide), {2, 2, 3}, std::span<const float>(values)));
  CHECK(image.width == 2);
  CHECK(image.height == 2);
  CHECK(image.pixels == std::vector<uint8_t>{0, 255, 128, 1, 2, 0, 255, 0, 255, 0, 254, 255});
}

TEST_CASE("a photograph over a background: colour + (1 - alpha) background") {
  Sample sample;
  sample.image = {3, 1, 3, {10, 20, 30, 0, 0, 0, 100, 100, 100}};
  sample.mask = {3, 1, 1, {255, 0, 128}};
  CHECK(over_background(sample, {255, 255, 255}).pixels ==
        std::vector<uint8_t>{10, 20, 30, 255, 255, 255, 227, 227, 227});
  CHECK(over_background(sample, {0, 100, 255}).pixels == std::vector<uint8_t>{10, 20, 30, 0, 100, 255, 100, 150, 227});
}

TEST_CASE("a sheet holds truth, render and four times their difference") {
  const Image8 truth = {1, 2, 3, {10, 20, 30, 0, 200, 5}}, render = {1, 2, 3, {12, 15, 30, 100, 0, 5}};
  const Image8 sheet = comparison_sheet(truth, render);
  CHECK(sheet.width == 3);
  CHECK(sheet.height == 2);
  CHECK(sheet.pixels == std::vector<uint8_t>{10, 20, 30, 12, 15, 30, 8, 20, 0, 0, 200, 5, 100, 0, 5, 255, 255, 0});
}

TEST_CASE("a config's way of drawing reaches the splatter") {
  const SplatOptions options = splat_options({true, 0.2, 0.1});
  CHECK(options.antialias);
  CHECK(options.near_plane == 0.2);
  CHECK(options.blur == 0.1);
  CHECK_FALSE(options.smooth_cutoff);
}
