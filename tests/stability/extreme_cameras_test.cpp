// Cameras at the edges of what captures and viewers have.
#include <algorithm>
#include <cmath>

#include "host/autograd/gradient_check.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/splat_drawing.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

/// Moves and sizes splats that fill a view of focal length `width` and centred principal point, so that they fill that
/// of `camera` (not turned).
SplatScene filling_view(SplatScene scene, const Camera& camera) {
  const double narrower = camera.width / camera.fx;
  for (int64_t n = 0; n < scene.count(); ++n) {
    const double z = scene.positions[3 * n + 2];
    scene.positions[3 * n] = scene.positions[3 * n] * narrower + z * (camera.width / 2.0 - camera.cx) / camera.fx;
    scene.positions[3 * n + 1] =
        scene.positions[3 * n + 1] * narrower + z * (camera.height / 2.0 - camera.cy) / camera.fy;
    for (int axis = 0; axis < 3; ++axis) scene.log_scales[3 * n + axis] += std::log(narrower);
  }
  return scene;
}

/// Image against the independent renderer; gradients in single against those in double precision, which pass finite
/// differences.
void check_view(KernelSet kernel_set, const SplatScene& scene, const Camera& camera) {
  SplatOptions options;
  options.smooth_cutoff = true;  // so that no pixel depends on which side of 1/255 it is
  Device &single = test::device(kernel_set), &exact = test::device(kernel_set, Real::Double);
  const Drawn drawn = draw(single, scene, camera, options), expected = draw(exact, scene, camera, options);
  const ReferenceImage reference = reference_render(scene, camera, drawing_background, options);
  CHECK(largest_difference(expected.color, reference.color) < 1e-9);
  CHECK(largest_difference(drawn.color, reference.color) < 2e-5);
  CHECK(largest_difference(drawn.alpha, reference.alpha) < 2e-5);
  CHECK(*std::max_element(reference.alpha.begin(), reference.alpha.end()) > 0.3);
  CHECK(gradient_difference(drawn, expected) < 1e-4);
  SplatWorkspace workspace;
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    const Splats splats{in[0], in[1], in[2], in[3], in[4], {}};
    return std::vector{splat(tape, workspace, splats, camera, drawing_background, options).color};
  };
  const Splats s = scene.upload(exact);
  GradientCheckOptions check;
  check.step = 1e-4 / camera.fx;  // a small part of a pixel
  check.samples_per_input = 8;
  CHECK(gradient_check(exact, function, {s.positions, s.rotations, s.log_scales, s.opacities, s.colors}, check) < 1e-4);
}

}  // namespace

TEST_CASE("focal lengths from a fifth of the image's width to twenty times it") {
  const KernelSet kernel_set = GENERATE(from_range(kernel_sets()));
  const auto [width, height] = GENERATE(std::pair{64, 64}, std::pair{3, 5});
  const double factor = GENERATE(0.2, 0.5, 4.0, 20.0);
  const bool fills = GENERATE(true, false);
  CAPTURE(width, factor, fills);
  Camera camera = plain_camera();
  camera.width = width;
  camera.height = height;
  camera.cx = 0.48 * width;
  camera.cy = 0.53 * height;
  camera.fx = factor * width;
  camera.fy = 1.05 * camera.fx;
  const SplatScene scene = random_scene(60, 21);
  check_view(kernel_set, fills ? filling_view(scene, camera) : scene, camera);
}

TEST_CASE("principal points outside of the image") {
  const KernelSet kernel_set = GENERATE(from_range(kernel_sets()));
  Camera camera = plain_camera();
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = GENERATE(32.0, 64.0, 640.0);
  const auto [x, y] = GENERATE(std::pair{-0.1, 0.5}, std::pair{-3.0, 0.5}, std::pair{0.4, 6.0}, std::pair{5.0, -4.0});
  camera.cx = x * camera.width;
  camera.cy = y * camera.height;
  CAPTURE(camera.fx, x, y);
  check_view(kernel_set, filling_view(random_scene(60, 22), camera), camera);
}

TEST_CASE("kilometres from the world's origin the picture is the same, and its gradients") {
  const KernelSet kernel_set = GENERATE(from_range(kernel_sets()));
  SplatScene scene = random_scene(25, 24);  // too few for an early end
  Camera camera = test_camera(64, 48);
  // Positions that are exact in float here and there.
  for (double& value : scene.positions) value = std::round(value * 2048) / 2048;
  SplatOptions options;
  options.smooth_cutoff = true;
  const Drawn expected = draw(test::device(kernel_set, Real::Double), scene, camera, options);
  const Eigen::Vector3d way(4096, -2048, 1024);
  for (int64_t n = 0; n < scene.count(); ++n) {
    for (int axis = 0; axis < 3; ++axis) scene.positions[3 * n + axis] += way[axis];
  }
  camera.translation -= camera.rotation * way;
  const Drawn drawn = draw(test::device(kernel_set), scene, camera, options);
  CHECK(largest_difference(drawn.color, expected.color) < 2e-5);
  CHECK(gradient_difference(drawn, expected) < 1e-4);
}

TEST_CASE("an image of 4096x3000 is its parts, bit for bit, and its gradient the sum of theirs") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  Camera camera;
  camera.width = 4096;
  camera.height = 3000;
  camera.fx = camera.fy = 2048;
  camera.cx = 2048;
  camera.cy = 1500;
  // Centres on quarters of a pixel at a depth of 2: no projection is rounded.
  constexpr int count = 30000;
  const std::vector<double> random = random_values(count * 14, 23, 0, 1);
  SplatScene scene;
  for (int n = 0; n < count; ++n) {
    const double* r = &random[14 * n];
    const auto log_scale = [&](double unit) { return std::log(0.5 + 8 * unit * unit) - std::log(1024); };
    scene.add({(std::floor(r[0] * 4 * 4096) / 4 - 2048) / 1024, (std::floor(r[1] * 4 * 3000) / 4 - 1500) / 1024, 2},
              {r[2] - 0.5, r[3] - 0.5, r[4] - 0.5, r[5] - 0.5}, {log_scale(r[6]), log_scale(r[7]), log_scale(r[8])},
              0.05 + 0.95 * r[9], {r[10], r[11], r[12]});
  }
  const auto draw_squares = [&](const Camera& of) {
    const Splats s = scene.upload(device);
    Tape tape(device);
    SplatWorkspace workspace;
    const Tensor color = splat(tape, workspace, s, of, drawing_background).color;
    tape.backward(sum(tape, multiply(tape, color, color)));
    std::vector<std::vector<double>> gradients;
    for (const Tensor& field : {s.positions, s.rotations, s.log_scales, s.opacities, s.colors}) {
      gradients.push_back(field.gradient().to_host<double>());
    }
    return std::pair(color.to_host<float>(), gradients);
  };
  const auto [whole, gradients] = draw_squares(camera);
  int64_t different = 0, covered = 0;
  std::vector<std::vector<double>> sums;
  for (const auto& gradient : gradients) sums.emplace_back(gradient.size(), 0.0);
  // Parts that begin and end within tiles.
  const std::array columns = {0, 1777, 4096}, rows = {0, 1203, 3000};
  for (int part = 0; part < 4; ++part) {
    const int left = columns[part % 2], top = rows[part / 2];
    const int width = columns[part % 2 + 1] - left, height = rows[part / 2 + 1] - top;
    const auto [image, shares] = draw_squares(camera.cropped(left, top, width, height));
    for (int row = 0; row < height; ++row) {
      for (int i = 0; i < 3 * width; ++i) {
        const float value = image[3 * width * row + i];
        different += value != whole[3 * (int64_t{camera.width} * (top + row) + left) + i];
        covered += value != static_cast<float>(drawing_background[i % 3]);
      }
    }
    for (size_t f = 0; f < sums.size(); ++f) {
      for (size_t i = 0; i < sums[f].size(); ++i) sums[f][i] += shares[f][i];
    }
  }
  CHECK(different == 0);
  CHECK(covered > 10'000'000);
  for (size_t f = 0; f < sums.size(); ++f) {
    const double largest = *std::max_element(sums[f].begin(), sums[f].end());
    double worst = 0;
    for (size_t i = 0; i < sums[f].size(); ++i) worst = std::max(worst, std::abs(sums[f][i] - gradients[f][i]));
    CAPTURE(f);
    CHECK(worst < 1e-5 * largest);
  }
}
