#include "host/ops/splat.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/autograd/gradient_check.h"
#include "tests/support/splat_reference.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("splatting equals the independent renderer") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const auto [width, height] =
      GENERATE(std::pair{16, 16}, std::pair{37, 29}, std::pair{64, 48}, std::pair{1, 1}, std::pair{131, 17});
  const bool antialias = GENERATE(false, true);
  const SplatScene scene = random_scene(150, 1);
  const Camera camera = test_camera(width, height);
  SplatOptions options;
  options.antialias = antialias;
  Tape tape(device, false);
  SplatWorkspace workspace;
  const SplatImage image = splat(tape, workspace, scene.upload(device), camera, {0.2, 0.5, 0.9}, options);
  const ReferenceImage expected = reference_render(scene, camera, {0.2, 0.5, 0.9}, options);
  CHECK(largest_difference(image.color.to_host<double>(), expected.color) < 2e-5);
  CHECK(largest_difference(image.alpha.to_host<double>(), expected.alpha) < 2e-5);
}

namespace {

/// The gradient check's function: inputs in the order of Splats' fields.
DifferentiableFunction drawn(SplatWorkspace& workspace, const Camera& camera, const SplatOptions& options) {
  return [&workspace, camera, options](Tape& tape, const std::vector<Tensor>& in) {
    const SplatImage image =
        splat(tape, workspace, {in[0], in[1], in[2], in[3], in[4]}, camera, {0.2, 0.5, 0.9}, options);
    return std::vector{image.color, image.alpha};
  };
}

double checked_gradient(Device& device, const SplatScene& scene, const Camera& camera, SplatOptions options) {
  options.smooth_cutoff = true;
  SplatWorkspace workspace;
  const Splats s = scene.upload(device);
  GradientCheckOptions check;
  check.step = 1e-6;
  check.samples_per_input = 40;
  return gradient_check(device, drawn(workspace, camera, options),
                        {s.positions, s.rotations, s.log_scales, s.opacities, s.colors}, check);
}

}  // namespace

TEST_CASE("splatting gradients pass finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  SplatOptions options;
  options.antialias = GENERATE(false, true);
  CHECK(checked_gradient(device, random_scene(21, 3), test_camera(37, 29), options) < 1e-5);
}
