#pragma once

#include <array>
#include <vector>

#include "host/ops/splat.h"

namespace degas::test {

/// Splat parameters on the host; arrays as in Splats.
struct SplatScene {
  std::vector<double> positions, rotations, log_scales, opacities, colors;

  int64_t count() const { return static_cast<int64_t>(opacities.size()); }
  /// Tensors that require gradients.
  Splats upload(Device& device) const;
  void add(std::array<double, 3> position, std::array<double, 4> rotation, std::array<double, 3> log_scale,
           double opacity, std::array<double, 3> color);
  void append(const SplatScene& other);
  /// The same splats in another order.
  SplatScene permuted(const std::vector<int>& order) const;
};

/// Random splats filling the frustum of test_camera, 2 to 6 metres away, some of them across its edges.
SplatScene random_scene(int count, unsigned seed);

/// Looks along +z from the origin, slightly turned; horizontal field of view about 53 degrees; principal point off
/// centre.
Camera test_camera(int width, int height);

struct ReferenceImage {
  std::vector<double> color, alpha;
};

/// A renderer in double precision that shares nothing with the kernels: textbook matrices, every splat in every pixel.
ReferenceImage reference_render(const SplatScene& scene, const Camera& camera, const std::array<double, 3>& background,
                                const SplatOptions& options);

/// Looks along +z from the origin; 48 x 32 pixels, centred.
inline Camera plain_camera() {
  Camera camera;
  camera.width = 48;
  camera.height = 32;
  camera.fx = camera.fy = 40;
  camera.cx = 24;
  camera.cy = 16;
  return camera;
}

}  // namespace degas::test
