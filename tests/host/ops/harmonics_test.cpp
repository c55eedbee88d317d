#include "host/ops/harmonics.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "host/autograd/gradient_check.h"
#include "host/ops/reduction.h"
#include "host/ops/splat.h"
#include "tests/support/harmonics_reference.h"
#include "tests/support/splat_reference.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

const Eigen::Vector3d camera_center(0.3, -0.2, 1.5);

struct ColouredSplats {
  Tensor positions, rotations, base_colors, harmonics;

  ColouredSplats(Device& device, int64_t count, int degree)
      : positions(random_tensor(device, {count, 3}, 1, -3, 3)),
        rotations(random_tensor(device, {count, 4}, 5, -2, 2)),
        base_colors(random_tensor(device, {count, 3}, 2, 0.2, 1)),
        harmonics(random_tensor(device, {count, harmonic_coefficients(degree), 3}, 3, -0.5, 0.5)) {}

  Tensor seen(Tape& tape) const {
    return colors_seen_from(tape, {camera_center}, positions, rotations, base_colors, harmonics);
  }

  /// By the Legendre functions of the standard library.
  std::vector<double> reference() const {
    const auto p = positions.to_host<double>(), q = rotations.to_host<double>(), base = base_colors.to_host<double>(),
               h = harmonics.to_host<double>();
    const size_t coefficients = harmonics.dim(1);
    std::vector<double> colors;
    for (size_t i = 0; i < p.size() / 3; ++i) {
      const Eigen::Matrix3d axes =
          Eigen::Quaterniond(q[4 * i], q[4 * i + 1], q[4 * i + 2], q[4 * i + 3]).normalized().toRotationMatrix();
      const auto basis = reference_harmonics(axes.transpose() *
                                             (Eigen::Vector3d(p[3 * i], p[3 * i + 1], p[3 * i + 2]) - camera_center));
      for (size_t c = 0; c < 3; ++c) {
        double color = base[3 * i + c];
        for (size_t j = 0; j < coefficients; ++j) color += basis[j] * h[(i * coefficients + j) * 3 + c];
        colors.push_back(std::max(0.0, color));
      }
    }
    return colors;
  }
};

}  // namespace

TEST_CASE("colours seen from a camera are the base plus spherical harmonics, at least 0") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const ColouredSplats scene(device, GENERATE(1, 16, 83), GENERATE(1, 2, 3));
  Tape tape(device, false);
  const std::vector<double> expected = scene.reference();
  CHECK(largest_difference(scene.seen(tape).to_host<double>(), expected) < 3e-6);
  if (expected.size() > 100) CHECK(std::count(expected.begin(), expected.end(), 0.0) > 0);
}

TEST_CASE("gradients of seen colours pass finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  ColouredSplats scene(device, 19, GENERATE(1, 2, 3));
  for (Tensor* input : {&scene.positions, &scene.rotations, &scene.base_colors, &scene.harmonics}) {
    input->set_requires_gradient();
  }
  const auto function = [](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{colors_seen_from(tape, {camera_center}, in[0], in[1], in[2], in[3])};
  };
  CHECK(gradient_check(device, function, {scene.positions, scene.rotations, scene.base_colors, scene.harmonics},
                       {1e-6, 200, 1}) < 1e-6);
}

TEST_CASE("splatting draws Gaussians in the colours that its camera sees, and differentiates through them") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const SplatScene scene = random_scene(17, 3);
  const Camera camera = test_camera(37, 29);
  Splats splats = scene.upload(device);
  splats.harmonics = random_tensor(device, {17, 8, 3}, 4, -0.3, 0.3).set_requires_gradient();
  SplatWorkspace workspace;
  SplatOptions options;
  options.smooth_cutoff = true;
  const auto draw = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{splat(tape, workspace, {in[0], in[1], splats.log_scales, splats.opacities, in[2], in[3]}, camera,
                             {0.2, 0.5, 0.9}, options)
                           .color};
  };
  CHECK(gradient_check(device, draw, {splats.positions, splats.rotations, splats.colors, splats.harmonics},
                       {1e-6, 30, 1}) < 1e-5);

  Tape tape(device, false);
  SplatScene seen = scene;
  seen.colors =
      colors_seen_from(tape, {camera.center()}, splats.positions, splats.rotations, splats.colors, splats.harmonics)
          .to_host<double>();
  const ReferenceImage expected = reference_render(seen, camera, {0.2, 0.5, 0.9}, options);
  const Tensor ours = draw(tape, {splats.positions, splats.rotations, splats.colors, splats.harmonics})[0];
  CHECK(largest_difference(ours.to_host<double>(), expected.color) < 1e-9);
}

TEST_CASE("places without a direction and numbers that are none stay where they are") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  ColouredSplats scene(device, 3, 2);
  std::vector<double> positions = scene.positions.to_host<double>();
  for (int c = 0; c < 3; ++c) positions[c] = camera_center[c];
  positions[3] = NAN;
  scene.positions.upload(std::span<const double>(positions));
  const Eigen::Vector3d center = camera_center.cast<float>().cast<double>();  // as the device rounds it
  for (Tensor* input : {&scene.positions, &scene.rotations, &scene.base_colors, &scene.harmonics}) {
    input->set_requires_gradient();
  }
  Tape tape(device);
  const Tensor colors =
      colors_seen_from(tape, {center}, scene.positions, scene.rotations, scene.base_colors, scene.harmonics);
  tape.backward(sum(tape, colors));
  const std::vector<double> seen = colors.to_host<double>(), base = scene.base_colors.to_host<double>();
  CHECK(std::isnan(seen[3]));
  for (int c = 0; c < 3; ++c) CHECK(seen[c] == Approx(base[c]));
  for (const Tensor& input : {scene.positions, scene.rotations, scene.base_colors, scene.harmonics}) {
    const std::vector<double> gradient = input.gradient().to_host<double>();
    CHECK(std::all_of(gradient.begin(), gradient.end(), [](double value) { return std::isfinite(value); }));
  }
}

TEST_CASE("coefficients of no degree are refused") {
  Device& device = test::device(KernelSet::Wide);
  ColouredSplats scene(device, 2, 1);
  scene.harmonics = Tensor::zeros(device, {2, 4, 3});
  Tape tape(device, false);
  CHECK_THROWS_AS(scene.seen(tape), std::logic_error);
}
