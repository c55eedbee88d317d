// From a coarse atlas to the finest: as many Gaussians as texels, the same person.
#include <cmath>

#include "host/ops/reduction.h"
#include "tests/support/splat_drawing.h"
#include "tests/support/test_devices.h"
#include "tests/support/tiny_subject.h"

using namespace degas;
using namespace degas::test;

namespace {

/// Pixels that the body's triangles cover, which at rest lie side by side.
double silhouette(const TinySubject& subject, const Camera& camera, const Eigen::Vector3d& translation) {
  const std::vector<Eigen::Vector3d> vertices = subject.body.canonical_vertices(subject.betas, {});
  double pixels = 0;
  for (const std::array<int, 3>& face : subject.body.faces()) {
    Eigen::Matrix<double, 3, 2> corners;
    for (int k = 0; k < 3; ++k) corners.row(k) = camera.project(vertices[face[k]] + translation).head<2>();
    const Eigen::RowVector2d a = corners.row(1) - corners.row(0), b = corners.row(2) - corners.row(0);
    pixels += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  return std::abs(pixels);
}

}  // namespace

TEST_CASE("at every resolution of the atlas the person covers what the mesh does, and moves as it does") {
  const KernelSet kernel_set = GENERATE(from_range(kernel_sets()));
  Device& device = test::device(kernel_set);
  const int resolution = GENERATE(64, 256, 1024);
  CAPTURE(resolution);
  const TinySubject subject(resolution);
  const auto count = static_cast<double>(subject.maps.covered.size());
  CHECK(count == Approx(0.64 * resolution * resolution).epsilon(0.05));

  const int64_t side = resolution;
  std::vector<float> heads(side * side * 4, 0.0f);
  for (int64_t texel = 0; texel < side * side; ++texel) heads[4 * texel + 3] = 1.4f;  // an opacity of 0.8
  const AssemblyMaps maps = {Tensor::zeros(device, {side, side, 3}),
                             Tensor::zeros(device, {side, side, 7}),
                             Tensor::from(device, {side, side, 4}, std::span<const float>(heads)),
                             {}};
  Pose pose;
  pose.axis_angles.assign(subject.body.joint_count(), Eigen::Vector3d::Zero());
  pose.translation = {-0.5, -0.5, 2};
  Camera camera;
  camera.width = camera.height = resolution > 256 ? 400 : 160;
  camera.fx = camera.fy = 1.25 * camera.width;
  camera.cx = camera.cy = camera.width / 2.0;
  DevicePose on_device = make_device_pose(device, pose);
  on_device.axis_angles.set_requires_gradient();
  on_device.translation.set_requires_gradient();
  Tape tape(device);
  SplatWorkspace workspace;
  SplatOptions options;
  options.smooth_cutoff = true;  // steps at 1/255 have no gradient, and small Gaussians are many
  const SplatImage image =
      splat(tape, workspace, subject.posed(tape, maps, on_device), camera, drawing_background, options);
  const Tensor covered = sum(tape, image.alpha);
  tape.backward(covered);
  const double expected = silhouette(subject, camera, pose.translation);
  const double drawn = covered.to_host<double>()[0], metres_to_pixels = camera.fx / pose.translation.z();
  // Gaussians reach some deviations farther than the mesh, whose border is about four metres long.
  const double deviation = std::hypot(std::exp(subject.maps.log_scales[0]) * metres_to_pixels, std::sqrt(options.blur));
  CHECK(drawn > expected);
  CHECK(drawn < expected + 3 * deviation * 4 * metres_to_pixels);
  // Nearer it covers more: the derivative of the mesh's silhouette. Not so sideways, where borders cancel and the sum
  // of what ends at a transmittance of 1e-4 within them, to which a step's gradient is blind, remains.
  const std::vector<double> by_translation = on_device.translation.gradient().to_host<double>();
  const Eigen::Vector3d step(0, 0, 1e-4);
  const double slope =
      (silhouette(subject, camera, pose.translation + step) - silhouette(subject, camera, pose.translation - step)) /
      2e-4;
  CHECK(by_translation[2] == Approx(slope * drawn / expected).epsilon(0.06));
  CHECK(all_finite(by_translation));
  CHECK(all_finite(on_device.axis_angles.gradient().to_host<double>()));
}
