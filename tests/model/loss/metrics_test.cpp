#include "model/loss/metrics.h"

#include <cmath>

#include "host/io/npz.h"
#include "host/ops/ssim.h"
#include "model/loss/lpips_weights.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

Image8 noise(int width, int height, unsigned seed) {
  Image8 image = Image8::black(width, height, 3);
  const std::vector<double> values = random_values(static_cast<int64_t>(image.pixels.size()), seed, 0, 255);
  for (size_t i = 0; i < values.size(); ++i) image.pixels[i] = static_cast<uint8_t>(values[i]);
  return image;
}

}  // namespace

TEST_CASE("PSNR by hand, clamped, capped, and NaN stays visible") {
  const std::vector<float> a{0, 0.5f, 1, 0.25f}, b{0.1f, 0.5f, 1, 0.25f};
  CHECK(psnr(a, b) == Approx(-10 * std::log10(0.01 / 4)).epsilon(1e-6));
  CHECK(psnr(a, a) == 100);
  CHECK(psnr(std::vector<float>{1.5f, -2.0f}, std::vector<float>{1, 0}) == 100);
  CHECK(std::isnan(psnr(std::vector<float>{NAN}, std::vector<float>{0})));
  CHECK_THROWS_AS(psnr(a, std::vector<float>{1}), std::logic_error);
}

TEST_CASE("squares and clipping of boxes") {
  const Rectangle square = grown_square({10, 20, 30, 60}, 50);
  CHECK(square.width == 160);
  CHECK(square.height == 160);
  CHECK(square.left == -55);
  CHECK(square.top == -30);
  const Rectangle inside = clipped({-5, 90, 20, 30}, 100, 100);
  CHECK(inside.left == 0);
  CHECK(inside.top == 90);
  CHECK(inside.width == 15);
  CHECK(inside.height == 10);
  CHECK(clipped({200, 0, 10, 10}, 100, 100).width == 0);
}

TEST_CASE("a picture's quality, whole and in a box") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Image8 target = noise(60, 50, 1);
  Image8 image = target;
  for (int y = 10; y < 30; ++y) {
    for (int x = 5; x < 30; ++x) image.at(x, y)[1] ^= 16;  // 16 levels in one of three channels
  }
  const QualityMeter meter(device, {});
  const ImageQuality whole = meter.measure(image, target, whole_region(image, {5, 10, 25, 20}));
  const auto in_box = [&](const Image8& picture, const Rectangle& box) {
    return meter.measure(picture, target, box_region(picture, box).value());
  };
  const double one = 16.0 / 255 * (16.0 / 255) / 3;
  CHECK(whole.psnr == Approx(-10 * std::log10(one * 500 / 3000)).epsilon(1e-5));
  CHECK(whole.lpips.empty());
  const ImageQuality box = in_box(image, {5, 10, 25, 20});
  CHECK(box.psnr == Approx(-10 * std::log10(one)).epsilon(1e-5));
  CHECK(box.ssim < whole.ssim);
  CHECK(in_box(image, {30, 10, 25, 20}).psnr == 100);
  CHECK(in_box(target, {5, 10, 25, 20}).ssim == Approx(1));
  // Only what lies within the picture counts; a box that is all but outside has no quality.
  CHECK(in_box(image, {-20, 10, 50, 20}).psnr == Approx(-10 * std::log10(one * 25 / 30)).epsilon(1e-5));
  CHECK_FALSE(box_region(image, {50, 10, 30, 30}));
  CHECK_THROWS_AS(meter.measure(image, noise(50, 60, 1), whole_region(image, {0, 0, 9, 9})), std::logic_error);
}

TEST_CASE("the cosine distance by hand") {
  const std::vector<float> a{3, 4}, b{4, 3}, zero{0, 0};
  CHECK(cosine_distance(a, b) == Approx(1 - 24.0 / 25));
  CHECK(cosine_distance(a, a) == Approx(0).margin(1e-15));
  CHECK(cosine_distance(a, std::vector<float>{-6, -8}) == Approx(2));
  CHECK(cosine_distance(a, zero) == 1);
  CHECK_THROWS_AS(cosine_distance(a, std::vector<float>{1}), std::logic_error);
}

TEST_CASE("LPIPS of the person's box grown by 50 pixels and squared, at 512x512 over white") {
  const std::string weights = data_path("weights/lpips_squeeze_v0.1.npz");
  if (weights.empty()) return;
  Device& device = test::device(KernelSet::Wide);
  const std::vector<LpipsLayer> layers = load_lpips_layers(weights, LpipsNetwork::Squeeze);
  const Image8 a = noise(90, 70, 1), b = noise(90, 70, 2);
  const QualityMeter meter(device, {layers});
  Tape tape(device, false);
  const auto cut = [&](const Image8& image, const Rectangle& r, int side) {
    std::vector<float> values(static_cast<size_t>(r.width) * r.height * 3, 1.0f);
    for (int y = 0; y < r.height; ++y) {
      for (int x = 0; x < r.width; ++x) {
        const int v = y + r.top, u = x + r.left;
        if (v < 0 || v >= image.height || u < 0 || u >= image.width) continue;
        for (int c = 0; c < 3; ++c) values[(static_cast<size_t>(y) * r.width + x) * 3 + c] = image.at(u, v)[c] / 255.0f;
      }
    }
    return resize(tape, Tensor::from(device, {r.height, r.width, 3}, std::span<const float>(values)), side, side);
  };
  const Lpips lpips(device, layers);
  const auto expected = [&](const Rectangle& r, int side) {
    return lpips.distance(tape, cut(a, r, side), cut(b, r, side)).to_host<double>()[0];
  };
  CHECK(meter.measure(a, b, whole_region(a, {20, 10, 30, 40})).lpips.at(0) ==
        Approx(expected({-35, -40, 140, 140}, 512)).epsilon(1e-5));
  CHECK(meter.measure(a, b, box_region(a, {20, 10, 30, 40}).value()).lpips.at(0) ==
        Approx(expected({15, 10, 40, 40}, 256)).epsilon(1e-5));
}
