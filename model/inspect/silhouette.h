#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "host/io/image.h"
#include "host/ops/camera.h"
#include "host/ops/image.h"

namespace degas {

/// A posed body as the rasteriser takes it.
struct BodySurface {
  std::vector<Eigen::Vector3f> vertices;   ///< world, metres
  std::vector<Eigen::Vector3i> triangles;  ///< counter-clockwise seen from outside

  BodySurface(const std::vector<Eigen::Vector3d>& vertices, const std::vector<std::array<int, 3>>& faces);
};

/// Where the body covers the centre of a pixel: one channel, 255 or 0, of the camera's size.
Image8 silhouette(const BodySurface& body, const Camera& camera);

/// Intersection over union of two masks of one size, pixels of 128 and more counting; within a box of them if given
/// (cut to the picture). 0 where both are empty.
double overlap(const Image8& a, const Image8& b, const std::optional<Rectangle>& box = {});

/// The photograph (RGB, foreground over black) with the body, lit from the camera, half transparent over it and the
/// border of its mask (empty: no border) in orange. All of the camera's size.
Image8 drawn_over(const Image8& photograph, const Image8& mask, const BodySurface& body, const Camera& camera);

}  // namespace degas
