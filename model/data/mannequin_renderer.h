#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "host/ops/camera.h"

namespace degas {

/// Linear albedo and gloss over the unit UV square; row 0 is v = 1.
struct MannequinTexture {
  int size = 0;
  std::vector<Eigen::Vector4f> texels;  // red, green, blue (linear, 0..1), gloss (0..1)
  /// Bilinear, clamped to the border.
  Eigen::Vector4f sample(float u, float v) const;
};

/// Light from infinitely far; `toward` is the unit vector to the light.
struct DirectionalLight {
  Eigen::Vector3f toward, color;
};
/// A studio: a soft key from the front left, a fill, a dome above and the floor's bounce; deterministic.
std::vector<DirectionalLight> studio_lights();

/// What one frame's pictures share: the posed surface and the light that falls on it.
struct LitScene {
  std::vector<Eigen::Vector3f> positions, normals, irradiance;  // per vertex, world
  const std::vector<Eigen::Vector3i>* triangles = nullptr;      // counter-clockwise seen from outside
  const std::vector<std::array<Eigen::Vector2f, 3>>* texture_coordinates = nullptr;  // per triangle corner
  const MannequinTexture* texture = nullptr;
  Eigen::Vector3f key_direction = Eigen::Vector3f(0.4F, 0.6F, 0.7F).normalized();  // of the highlights
};

/// Fills scene.irradiance: every light with its own shadow map (percentage-closer filtering), so that many of
/// them give soft shadows and ambient occlusion. `casters` are the triangles that throw shadows.
void light_scene(LitScene& scene, const std::vector<Eigen::Vector3i>& casters,
                 const std::vector<DirectionalLight>& lights, int threads);

/// A picture: RGB foreground over black (premultiplied by alpha, sRGB encoded) and alpha, 0..255, row by row.
struct RenderedPicture {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb, alpha;
};

/// Z-buffer rasteriser with supersampling^2 samples a pixel, perspective-correct attributes, back faces culled;
/// triangles that reach within 5 cm of the camera's plane are left out. The bits depend on the input only.
RenderedPicture rasterize(const LitScene& scene, const Camera& camera, int supersampling);

/// Runs body(i) for i in [0, count) on up to `threads` threads; i -> thread is not fixed, so bodies write apart. Of
/// what they throw the first by i is thrown when all are done.
void for_each_parallel(int count, int threads, const std::function<void(int)>& body);

}  // namespace degas
