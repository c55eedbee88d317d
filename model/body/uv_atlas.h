#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "model/body/body_model.h"

namespace degas {

/// The triangle under a texel's centre.
struct Texel {
  int triangle = -1;  ///< -1: no triangle covers the centre
  std::array<float, 3> barycentric = {0, 0, 0};
};

/// A body's triangles rasterised into its texture layout at R x R texels: row 0 is the top (v = 1), texel centres lie
/// at +0.5, so the centre of (row, column) is u = (column + 0.5) / R, v = 1 - (row + 0.5) / R. Where triangles overlap
/// or share an edge, the lowest index wins. Holds copies, so that it outlives the body model.
class UvAtlas {
 public:
  /// Error when no texel is covered.
  UvAtlas(const BodyModel& body, int resolution);

  int resolution() const { return resolution_; }
  const std::vector<Texel>& texels() const { return texels_; }  ///< R x R
  const std::vector<int>& covered() const { return covered_; }  ///< row * R + column of the covered texels, ascending
  const std::vector<std::array<int, 3>>& faces() const { return faces_; }  ///< vertices of each triangle

  /// Interpolates a (V, channels) quantity of the vertices: (R, R, channels), zero where nothing is covered.
  std::vector<float> map(std::span<const float> values, int channels) const;
  /// The same of a vector per vertex: positions in metres make the posed vertex map, (R, R, 3).
  std::vector<float> map(const std::vector<Eigen::Vector3d>& vectors) const;

 private:
  int resolution_;
  size_t vertex_count_;
  std::vector<Texel> texels_;
  std::vector<int> covered_;
  std::vector<std::array<int, 3>> faces_;
};

/// Which texels each joint moves (method.md, "Joint masks"): (resolution, resolution, J - 1), 1 where the interpolated
/// weight of joint 1 + j is above zero, else 0.
std::vector<float> joint_masks(const BodyModel& body, int resolution);

}  // namespace degas
