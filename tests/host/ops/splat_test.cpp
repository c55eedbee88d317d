#include "host/ops/splat.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "host/autograd/gradient_check.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/splat_drawing.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

constexpr std::array<double, 3> background = {0.2, 0.5, 0.9};

/// Largest error of the tape's gradients against finite differences, with the smooth cut-off.
double gradient_error(Device& device, const SplatScene& scene, const Camera& camera, SplatOptions options = {}) {
  options.smooth_cutoff = true;
  SplatWorkspace workspace;
  const auto draw = [&](Tape& tape, const std::vector<Tensor>& in) {
    const SplatImage image =
        splat(tape, workspace, {in[0], in[1], in[2], in[3], in[4], {}}, camera, background, options);
    return std::vector{image.color, image.alpha};
  };
  const Splats s = scene.upload(device);
  GradientCheckOptions check;
  check.step = 1e-6;
  check.samples_per_input = 30;
  return gradient_check(device, draw, {s.positions, s.rotations, s.log_scales, s.opacities, s.colors}, check);
}

}  // namespace

TEST_CASE("splatting equals the independent renderer") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const auto [width, height] =
      GENERATE(std::pair{16, 16}, std::pair{37, 29}, std::pair{64, 48}, std::pair{1, 1}, std::pair{131, 17});
  SplatOptions options;
  options.antialias = GENERATE(false, true);
  const SplatScene scene = random_scene(150, 1);
  const Camera camera = test_camera(width, height);
  Tape tape(device, false);
  SplatWorkspace workspace;
  const SplatImage image = splat(tape, workspace, scene.upload(device), camera, background, options);
  const ReferenceImage expected = reference_render(scene, camera, background, options);
  CHECK(largest_difference(image.color.to_host<double>(), expected.color) < 2e-5);
  CHECK(largest_difference(image.alpha.to_host<double>(), expected.alpha) < 2e-5);
}

TEST_CASE("splatting gradients pass finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  SplatOptions options;
  options.antialias = GENERATE(false, true);
  const int count = GENERATE(15, 16, 17, 21);  // around a whole vector of splats
  CHECK(gradient_error(device, random_scene(count, 3), test_camera(37, 29), options) < 1e-5);
}

TEST_CASE("gradients hold where the Jacobian is clamped") {
  // Centres at 1.2 (free) and 1.5 times (clamped) the half frustum, on each side of each axis, wide enough to be seen.
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const Camera camera = plain_camera();
  SplatScene scene;
  const double edge_x = 0.6, edge_y = 0.4, z = 2;
  for (double factor : {1.2, 1.5}) {
    for (double side : {-1.0, 1.0}) {
      scene.add({side * factor * edge_x * z, 0.1, z + 0.1 * side + factor}, upright, {-0.4, -1.5, -0.8}, 0.7,
                {1, 0.3, 0.2});
      scene.add({0.1, side * factor * edge_y * z, z + 0.15 * side + factor}, {0.9, 0.3, 0.1, 0.2}, {-1.5, -0.5, -0.7},
                0.6, {0.1, 0.9, 0.2});
    }
  }
  CHECK(gradient_error(device, scene, camera) < 1e-5);
}

TEST_CASE("gradients of the antialiased opacity hold far below a pixel, and vanish at the compensation's floor") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  SplatOptions options;
  options.antialias = true;
  SplatScene scene;
  scene.add({0.02, 0.01, 2}, {1, 0.2, 0.3, 0.1}, {-4.3, -4.6, -4.4}, 0.95, {1, 0.5, 0.2});
  scene.add({0.3, 0.2, 2}, upright, {-4, -3.5, -4.2}, 0.9, {0.2, 0.5, 1});
  CHECK(gradient_error(device, scene, plain_camera(), options) < 1e-5);
  // 45 micrometres: 0.95 times the floor of 0.005 is just visible. Alone, so that no larger gradient hides its own.
  SplatScene speck;
  speck.add({0.0125, 0.0125, 1}, upright, {-10, -10, -10}, 0.95, {1, 0.5, 0.2});
  // Its gradients are near what differences of doubles can tell.
  CHECK(gradient_error(device, speck, plain_camera(), options) < 1e-4);
  Tape tape(device);
  SplatWorkspace workspace;
  const Splats splats = speck.upload(device);
  const SplatImage image = splat(tape, workspace, splats, plain_camera(), background, options);
  tape.backward(sum(tape, image.alpha));
  CHECK(splats.opacities.gradient().to_host<double>()[0] == Approx(0.005).epsilon(1e-3));
}

TEST_CASE("a clamped alpha passes no opacity gradient") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  SplatScene scene;
  scene.add({0.03, 0.02, 1}, upright, {-0.7, -0.8, -0.7}, 0.997, {1, 0.5, 0.2});
  scene.add({-0.03, 0.02, 2}, upright, {-0.7, -0.8, -0.7}, 0.5, {0.1, 0.5, 0.2});
  CHECK(gradient_error(device, scene, plain_camera()) < 1e-5);
  // So wide that alpha is clamped in every pixel.
  SplatScene wide;
  wide.add({0, 0, 1}, upright, {4, 4, 4}, 0.997, {1, 0.5, 0.2});
  const Splats splats = wide.upload(device);
  Tape tape(device);
  SplatWorkspace workspace;
  tape.backward(sum(tape, splat(tape, workspace, splats, plain_camera(), background).color));
  CHECK(splats.opacities.gradient().to_host<double>()[0] == 0);
  CHECK(splats.colors.gradient().to_host<double>()[0] == Approx(0.99 * 48 * 32));
}

TEST_CASE("behind the last contributor there is nothing, forward and backward") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  SplatScene scene;
  for (int n = 0; n < 30; ++n) {
    scene.add({0, 0, 1 + 0.1 * n}, upright, {3, 3, 3}, 0.9, {0.1 * (n % 7), 0.5, 1 - 0.03 * n});
  }
  const Splats splats = scene.upload(device);
  Tape tape(device);
  SplatWorkspace workspace;
  const SplatImage image = splat(tape, workspace, splats, plain_camera(), background);
  const ReferenceImage expected = reference_render(scene, plain_camera(), background, {});
  CHECK(largest_difference(image.color.to_host<double>(), expected.color) < 1e-5);
  const std::vector<double> alpha = image.alpha.to_host<double>();
  tape.backward(sum(tape, image.color));
  const std::vector<double> gradient = splats.colors.gradient().to_host<double>();
  // 0.1^4 = 1e-4 may or may not be below the limit; after five splats every pixel is full.
  for (int n = 0; n < 4; ++n) CHECK(gradient[3 * n] > 0);
  for (int n = 5; n < 30; ++n) CHECK(gradient[3 * n] == 0);
  CHECK(gradient[0] == Approx(0.9 * 48 * 32).epsilon(0.02));
  CHECK(*std::min_element(alpha.begin(), alpha.end()) > 0.9998);
}

TEST_CASE("an off-centre principal point gives the crop of the full image") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Camera full = test_camera(128, 96);
  const int left = 80, top = 56, width = 41, height = 33;
  SplatScene scene = random_scene(200, 4);
  // Small enough not to reach the crop from where its Jacobian is clamped and the full image's is not.
  for (double& value : scene.log_scales) value = std::min(value, -3.0);
  const Splats splats = scene.upload(device);
  Tape tape(device, false);
  SplatWorkspace workspace;
  const std::vector<double> whole = splat(tape, workspace, splats, full, background).color.to_host<double>();
  const std::vector<double> part =
      splat(tape, workspace, splats, full.cropped(left, top, width, height), background).color.to_host<double>();
  std::vector<double> expected;
  for (int row = 0; row < height; ++row) {
    const auto begin = whole.begin() + ((top + row) * 128 + left) * 3;
    expected.insert(expected.end(), begin, begin + width * 3);
  }
  CHECK(largest_difference(part, expected) < 1e-5);
}

TEST_CASE("shuffled splats give the same image, also at equal depths") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  SplatScene scene = random_scene(200, 5);
  std::vector<int> order(scene.count());
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(2));
  Tape tape(device, false);
  SplatWorkspace workspace;
  const Camera camera = test_camera(64, 48);
  const auto draw = [&](const SplatScene& s) {
    return splat(tape, workspace, s.upload(device), camera, background).color.to_host<double>();
  };
  CHECK(draw(scene) == draw(scene.permuted(order)));
  // Equal depths: the index decides, as in the reference's stable sort.
  SplatScene ties;
  for (int n = 0; n < 40; ++n)
    ties.add({0.01 * n, 0, 2}, upright, {-2, -2, -2}, 0.4, {n % 3 / 2.0, n % 5 / 4.0, n % 7 / 6.0});
  Camera plain = plain_camera();
  const std::vector<double> image =
      splat(tape, workspace, ties.upload(device), plain, background).color.to_host<double>();
  CHECK(largest_difference(image, reference_render(ties, plain, background, {}).color) < 2e-5);
}

TEST_CASE("two runs give equal bits and the second allocates nothing", "[large]") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const SplatScene scene = random_scene(400, 6);
  const Tensor weights = random_tensor(device, {77, 93, 3}, 3);
  SplatWorkspace workspace;
  const auto run = [&] {
    const Splats splats = scene.upload(device);
    Tape tape(device);
    const SplatImage image = splat(tape, workspace, splats, test_camera(93, 77), background);
    tape.backward(sum(tape, multiply(tape, image.color, weights)));
    std::vector<std::vector<float>> bits = {image.color.to_host<float>(), image.alpha.to_host<float>()};
    for (const Tensor& field :
         {splats.positions, splats.rotations, splats.log_scales, splats.opacities, splats.colors}) {
      bits.push_back(field.gradient().to_host<float>());
    }
    return bits;
  };
  const auto first = run();
  const size_t allocations = device.memory_statistics().device_allocations;
  CHECK(run() == first);
  CHECK(device.memory_statistics().device_allocations == allocations);
}

TEST_CASE("views drawn together are the views drawn alone, and their gradients the sum") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const bool with_harmonics = GENERATE(false, true);
  const std::vector<SplatView> views = {
      {test_camera(37, 29), background}, {plain_camera(), {0.9, 0.1, 0.4}}, {test_camera(16, 50), {0, 0, 1}}};
  const SplatScene scene = random_scene(45, 9);
  const Tensor harmonics = random_tensor(device, {45, 3, 3}, 4, -0.3, 0.3);
  const auto gradients_of = [&](const std::vector<std::vector<SplatView>>& groups, std::vector<double>& pixels) {
    SplatWorkspace workspace;
    Splats splats = scene.upload(device);
    if (with_harmonics)
      splats.harmonics = Tensor::from(device, harmonics.shape(), std::span<const double>(harmonics.to_host<double>()))
                             .set_requires_gradient();
    Tape tape(device);
    Tensor total;
    unsigned seed = 1;
    for (const auto& group : groups) {
      for (const SplatImage& image : splat(tape, workspace, splats, group)) {
        const std::vector<double> values = image.color.to_host<double>();
        pixels.insert(pixels.end(), values.begin(), values.end());
        const Tensor weights = random_tensor(device, image.color.shape(), seed++);
        const Tensor term = add(tape, sum(tape, multiply(tape, image.color, weights)), mean(tape, image.alpha));
        total = total.defined() ? add(tape, total, term) : term;
      }
    }
    tape.backward(total);
    std::vector<std::vector<double>> gradients;
    std::vector<Tensor> fields = {splats.positions, splats.rotations, splats.log_scales, splats.opacities,
                                  splats.colors};
    if (with_harmonics) fields.push_back(splats.harmonics);
    for (const Tensor& field : fields) gradients.push_back(field.gradient().to_host<double>());
    return gradients;
  };
  std::vector<double> together, alone;
  const auto sums = gradients_of({views}, together),
             expected = gradients_of({{views[0]}, {views[1]}, {views[2]}}, alone);
  CHECK(together == alone);
  REQUIRE(sums.size() == expected.size());
  for (size_t f = 0; f < sums.size(); ++f) CHECK(largest_difference(sums[f], expected[f]) < 1e-12);
}
