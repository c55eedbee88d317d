// Scenes at the edges of what an avatar makes, whose images and gradients have closed forms.
#include <algorithm>
#include <cmath>

#include "host/ops/reduction.h"
#include "tests/support/splat_drawing.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

enum Field { Positions, Rotations, LogScales, Opacities, Colors };

}  // namespace

TEST_CASE("one Gaussian has the closed form's image and gradients, from a hundredth of a pixel to a thousand") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  Camera camera = plain_camera();
  camera.cx = 23.25, camera.cy = 16.5;
  const double z = 2, opacity = 0.8;
  const std::array<double, 3> color = {0.9, 0.1, 0.4};
  const double pixels = GENERATE(0.01, 0.3, 1.0, 10.0, 1000.0);
  SplatScene scene;
  const double log_scale = std::log(pixels * z / camera.fx);
  scene.add({0, 0, z}, upright, {log_scale, log_scale, log_scale}, opacity, color);
  const Drawn drawn = draw(device, scene, camera);

  // On the optical axis a ball's covariance in the image is v times the identity, without a slope along x and y.
  const double bare = pixels * pixels, v = bare + SplatOptions{}.blur;
  const std::vector<double> weights = drawing_weights(camera);
  std::vector<double> alphas, image;
  double by_v = 0, by_x = 0, by_y = 0, by_opacity = 0;
  std::array<double, 3> by_color = {};
  for (int pixel = 0; pixel < camera.width * camera.height; ++pixel) {
    const double dx = pixel % camera.width + 0.5 - camera.cx, dy = pixel / camera.width + 0.5 - camera.cy;
    const double squared = dx * dx + dy * dy, gaussian = std::exp(-squared / (2 * v));
    const double alpha = opacity * gaussian < faintest_opacity ? 0 : opacity * gaussian;
    double worth = 1.0 / (camera.width * camera.height);
    for (int c = 0; c < 3; ++c) {
      worth += weights[3 * pixel + c] * (color[c] - drawing_background[c]);
      by_color[c] += weights[3 * pixel + c] * alpha;
      image.push_back(alpha * color[c] + (1 - alpha) * drawing_background[c]);
    }
    alphas.push_back(alpha);
    by_opacity += worth * alpha / opacity;
    by_x += worth * alpha * dx / v;
    by_y += worth * alpha * dy / v;
    by_v += worth * alpha * squared / (2 * v * v);
  }
  CHECK(largest_difference(drawn.alpha, alphas) < 2e-6);
  CHECK(largest_difference(drawn.color, image) < 2e-6);
  const auto near = [](double expected, double scale) { return Approx(expected).margin(2e-5 * scale).epsilon(2e-5); };
  const double to_pixels = camera.fx / z, along = std::abs(by_x) + std::abs(by_y);
  CHECK(drawn.gradients[Positions][0] == near(by_x * to_pixels, along * to_pixels));
  CHECK(drawn.gradients[Positions][1] == near(by_y * to_pixels, along * to_pixels));
  CHECK(drawn.gradients[Positions][2] == near(-2 * bare / z * by_v, 0.1));
  const auto& scales = drawn.gradients[LogScales];
  CHECK(scales[0] + scales[1] == near(2 * bare * by_v, 0.1));
  CHECK(std::abs(scales[2]) < 1e-6 * (std::abs(scales[0]) + 1));
  CHECK(drawn.gradients[Opacities][0] == near(by_opacity, 1));
  for (int c = 0; c < 3; ++c) CHECK(drawn.gradients[Colors][c] == near(by_color[c], 1));
}

TEST_CASE("a million Gaussians in one pixel blend in their order up to the early end, and no further") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  // At one depth, so that the index orders them, on a pixel's centre; the neighbours' alpha is below 1/255.
  constexpr int count = 1'000'000;
  constexpr double opacity = 0.004;
  Camera camera = plain_camera();
  camera.width = camera.height = 24;
  camera.cx = camera.cy = 12.5;
  const auto color_of = [](int n) { return std::array{n % 7 / 8.0, n < 1000 ? 1.0 : 0.0, 0.5}; };
  SplatScene scene;
  for (int n = 0; n < count; ++n) scene.add({0, 0, 2}, upright, {-12, -12, -12}, opacity, color_of(n));
  const Drawn drawn = draw(device, scene, camera);

  const int middle = 12 * camera.width + 12;
  std::array<double, 3> color = {};
  double left_over = 1;
  int drawn_count = 0;
  for (; left_over >= 1e-4; ++drawn_count) {
    for (int c = 0; c < 3; ++c) color[c] += left_over * opacity * color_of(drawn_count)[c];
    left_over *= 1 - opacity;
  }
  for (int c = 0; c < 3; ++c) {
    CHECK(drawn.color[3 * middle + c] == Approx(color[c] + left_over * drawing_background[c]).margin(1e-5));
  }
  CHECK(drawn.alpha[middle] == Approx(1 - left_over).margin(1e-5));
  CHECK(std::count(drawn.alpha.begin(), drawn.alpha.end(), 0.0) == camera.width * camera.height - 1);

  // Gradients: T_n opacity for the colour; colour less what is behind for the first opacity.
  const std::vector<double> weights = drawing_weights(camera);
  const double blue_weight = weights[3 * middle + 2], green_weight = weights[3 * middle + 1];
  const auto& colors = drawn.gradients[Colors];
  CHECK(std::abs(blue_weight) > 0.01);
  double worst = 0;
  for (int n = 0; n < drawn_count - 2; ++n) {
    const double expected = opacity * std::pow(1 - opacity, n);
    worst = std::max({worst, std::abs(colors[3 * n + 2] / blue_weight - expected),
                      std::abs(colors[3 * n + 1] / green_weight - expected)});
  }
  // The way back divides by as many rounded 1 - alpha.
  CHECK(worst < 1e-4 * opacity);
  double first = 1.0 / (camera.width * camera.height) * left_over / (1 - opacity);
  for (int c = 0; c < 3; ++c) {
    const double behind = (color[c] - opacity * color_of(0)[c] + left_over * drawing_background[c]) / (1 - opacity);
    first += weights[3 * middle + c] * (color_of(0)[c] - behind);
  }
  CHECK(drawn.gradients[Opacities][0] == Approx(first).epsilon(1e-3));
  // By rounding the end may be off by one.
  for (int f = 0; f < 5; ++f) {
    const auto& gradient = drawn.gradients[f];
    const auto after = gradient.begin() + static_cast<long>(gradient.size() / count * (drawn_count + 2));
    CHECK(all_zero({after, gradient.end()}));
    CHECK(all_finite(gradient));
  }
}

TEST_CASE("all opaque: the two front Gaussians make the image, the fourth is worth nothing") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  constexpr int count = 5000;
  const Camera camera = plain_camera();
  const std::vector<double> colors = random_values(count * 3, 3, 0, 1), turns = random_values(count * 4, 4);
  SplatScene scene;
  const auto depth_of = [](int n) { return 1 + 0.001 * (n * 1009 % count); };  // each depth once
  std::vector<int> front_to_back(count);
  for (int n = 0; n < count; ++n) {
    front_to_back[n * 1009 % count] = n;
    // So wide that alpha is clamped in every pixel.
    scene.add({0, 0, depth_of(n)}, {turns[4 * n], turns[4 * n + 1], turns[4 * n + 2], turns[4 * n + 3]}, {7, 7, 7}, 1,
              {colors[3 * n], colors[3 * n + 1], colors[3 * n + 2]});
  }
  const Drawn drawn = draw(device, scene, camera);
  const auto color_of = [&](int rank, int c) { return colors[3 * front_to_back[rank] + c]; };
  double worst = 0;
  for (size_t i = 0; i < drawn.color.size(); ++i) {
    const int c = static_cast<int>(i % 3);
    worst = std::max(worst, std::abs(drawn.color[i] - 0.99 * color_of(0, c) - 0.0099 * color_of(1, c)));
  }
  CHECK(worst < 1.1e-4);
  CHECK(*std::min_element(drawn.alpha.begin(), drawn.alpha.end()) > 0.9998);
  // Alpha is clamped everywhere: nothing moves it.
  for (const Field field : {Positions, Rotations, LogScales, Opacities}) CHECK(all_zero(drawn.gradients[field]));
  const std::vector<double> weights = drawing_weights(camera);
  for (int c = 0; c < 3; ++c) {
    double total = 0;
    for (size_t i = c; i < weights.size(); i += 3) total += weights[i];
    CHECK(drawn.gradients[Colors][3 * front_to_back[0] + c] == Approx(0.99 * total).epsilon(1e-4).margin(1e-3));
    CHECK(drawn.gradients[Colors][3 * front_to_back[1] + c] == Approx(0.0099 * total).epsilon(1e-4).margin(1e-4));
    bool none_behind = true;
    for (int rank = 3; rank < count; ++rank) none_behind &= drawn.gradients[Colors][3 * front_to_back[rank] + c] == 0;
    CHECK(none_behind);
  }
}

TEST_CASE("behind the last contributor gradients are zero whatever their memory held before") {
  // Not poisoned: NaNs would be taken for an overflow, whose gradient is zero too.
  DeviceOptions options;
  options.kernel_set = GENERATE(from_range(kernel_sets()));
  if (options.kernel_set == KernelSet::Wide) options.family = DeviceFamily::WideCpu;
  Device device(options);
  constexpr int count = 5000;
  SplatScene scene;
  for (int n = 0; n < count; ++n) scene.add({0, 0, 2}, upright, {3, 3, 3}, 0.9, {0.5, 0.5, 0.5});
  const Splats splats = scene.upload(device);
  SplatWorkspace workspace;
  const auto draw_once = [&] {
    Tape tape(device);
    tape.backward(sum(tape, splat(tape, workspace, splats, plain_camera(), drawing_background).color));
  };
  draw_once();
  for (Tensor tensor : {splats.positions, splats.rotations, splats.log_scales, splats.opacities, splats.colors}) {
    tensor.clear_gradient();
  }
  const std::vector<float> leftovers(workspace.capacity() * 16, 1.0f);
  Tensor::from(device, {workspace.capacity(), 16}, std::span<const float>(leftovers));  // as the gradient slots are
  draw_once();
  for (const Tensor& field : {splats.positions, splats.rotations, splats.log_scales, splats.opacities, splats.colors}) {
    const std::vector<double> gradient = field.gradient().to_host<double>();
    CHECK(all_zero({gradient.begin() + static_cast<long>(gradient.size() / count * 6), gradient.end()}));
  }
  CHECK(!all_zero(splats.colors.gradient().to_host<double>()));
}

TEST_CASE("all transparent, all behind or all beside leave the background bit for bit, and no gradient") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  SplatScene scene = random_scene(20000, 5);
  const Camera camera = test_camera(64, 48);
  const int change = GENERATE(0, 1, 2, 3);
  CAPTURE(change);
  for (int64_t n = 0; n < scene.count(); ++n) {
    if (change == 0) scene.opacities[n] = faintest_opacity * (n % 2 ? 1 - 1e-6 : 0.0);
    if (change == 1) scene.positions[3 * n + 2] *= -1;
    if (change == 2) scene.positions[3 * n] = 100 + scene.positions[3 * n];
    if (change == 3) scene.opacities[n] = n % 2 ? 1 + 1e-6 : -0.5;
  }
  SplatOptions options;
  options.antialias = GENERATE(false, true);
  CHECK(is_untouched(draw(device, scene, camera, options)));
  if (change != 0) return;
  // A hair's breadth above 1/255 one of them shows.
  scene.opacities[7] = faintest_opacity * (1 + 1e-4);
  scene.positions[21] = scene.positions[22] = 0;
  for (int axis = 0; axis < 3; ++axis) scene.log_scales[21 + axis] = 3;
  CHECK(!is_untouched(draw(device, scene, camera, options)));
}
