#include "model/gaussians/world_harmonics.h"

#include "host/ops/harmonics.h"
#include "tests/support/harmonics_reference.h"
#include "tests/support/splat_reference.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("harmonics in the world's axes show what those in the Gaussians' axes show, from everywhere") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const size_t coefficients = harmonic_coefficients(GENERATE(1, 2, 3));
  const SplatScene scene = random_scene(23, 5);
  Splats splats = scene.upload(device);
  splats.harmonics = random_tensor(device, {23, static_cast<int64_t>(coefficients), 3}, 6);
  splats.colors = Tensor::zeros(device, {23, 3});
  Tape tape(device, false);
  const std::vector<float> world = world_harmonics(tape, splats);
  for (const Eigen::Vector3d& center :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(3, -2, 9), Eigen::Vector3d(0, 8, 1)}) {
    const std::vector<double> seen =
        colors_seen_from(tape, {center}, splats.positions, splats.rotations, splats.colors, splats.harmonics)
            .to_host<double>();
    double largest = 0;
    for (size_t n = 0; n < 23; ++n) {
      const auto basis = reference_harmonics(Eigen::Map<const Eigen::Vector3d>(&scene.positions[3 * n]) - center);
      for (size_t c = 0; c < 3; ++c) {
        double expected = 0;
        for (size_t j = 0; j < coefficients; ++j) expected += basis[j] * world[(n * coefficients + j) * 3 + c];
        largest = std::max(largest, std::abs(std::max(0.0, expected) - seen[3 * n + c]));
      }
    }
    CHECK(largest < 1e-5);
  }
}
