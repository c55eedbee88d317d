#include "model/body/uv_atlas.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "host/error.h"
#include "model/body/plane.h"

namespace degas {

namespace {

using Eigen::Vector2d;

/// Covers the free texels whose centres lie in the triangle; `corners` in texels, y down.
void rasterise(const std::array<Vector2d, 3>& corners, int triangle, int resolution, std::vector<Texel>& texels) {
  const auto& [a, b, c] = corners;
  const double area = cross(b - a, c - a);
  if (std::abs(area) < 1e-12) return;
  const Vector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  const int left = std::max(0, static_cast<int>(std::ceil(low.x() - 0.5)));
  const int right = std::min(resolution - 1, static_cast<int>(std::floor(high.x() - 0.5)));
  const int top = std::max(0, static_cast<int>(std::ceil(low.y() - 0.5)));
  const int bottom = std::min(resolution - 1, static_cast<int>(std::floor(high.y() - 0.5)));
  for (int row = top; row <= bottom; ++row) {
    for (int column = left; column <= right; ++column) {
      Texel& texel = texels[static_cast<size_t>(row) * resolution + column];
      if (texel.triangle >= 0) continue;
      const Vector2d center(column + 0.5, row + 0.5);
      const double first = cross(b - center, c - center) / area, second = cross(c - center, a - center) / area;
      const double third = 1 - first - second;
      if (first < 0 || second < 0 || third < 0) continue;
      texel = {triangle, {static_cast<float>(first), static_cast<float>(second), static_cast<float>(third)}};
    }
  }
}

}  // namespace

UvAtlas::UvAtlas(const BodyModel& body, int resolution)
    : resolution_(resolution), vertex_count_(body.vertex_count()), faces_(body.faces()) {
  if (resolution < 1) throw std::logic_error("[uv_atlas] resolution must be positive");
  texels_.resize(static_cast<size_t>(resolution) * resolution);
  for (int t = 0; t < body.face_count(); ++t) {
    std::array<Vector2d, 3> corners;
    for (int k = 0; k < 3; ++k) {
      const Vector2d& uv = body.texture_coordinates()[body.texture_faces()[t][k]];
      corners[k] = Vector2d(uv.x(), 1 - uv.y()) * resolution;
    }
    rasterise(corners, t, resolution, texels_);
  }
  for (size_t i = 0; i < texels_.size(); ++i) {
    if (texels_[i].triangle >= 0) covered_.push_back(static_cast<int>(i));
  }
  if (covered_.empty()) {
    throw Error::format("{}: 'vt' covers no texel of a {}x{} atlas; texture coordinates lie in 0..1",
                        body.path().string(), resolution, resolution);
  }
}

std::vector<float> UvAtlas::map(std::span<const float> values, int channels) const {
  if (values.size() != vertex_count_ * channels) {
    throw std::logic_error(
        fmt::format("[uv_atlas] {} values for {} vertices x {}", values.size(), vertex_count_, channels));
  }
  std::vector<float> result(texels_.size() * channels, 0.f);
  for (const int index : covered_) {
    const Texel& texel = texels_[index];
    float* target = result.data() + static_cast<size_t>(index) * channels;
    for (int k = 0; k < 3; ++k) {
      const float* source = values.data() + static_cast<size_t>(faces_[texel.triangle][k]) * channels;
      for (int c = 0; c < channels; ++c) target[c] += texel.barycentric[k] * source[c];
    }
  }
  return result;
}

std::vector<float> UvAtlas::map(const std::vector<Eigen::Vector3d>& vectors) const {
  if (vectors.size() != vertex_count_) {
    throw std::logic_error(fmt::format("[uv_atlas] {} vectors for {} vertices", vectors.size(), vertex_count_));
  }
  std::vector<Eigen::Vector3f> vertices(vectors.size());
  for (size_t v = 0; v < vertices.size(); ++v) vertices[v] = vectors[v].cast<float>();
  std::vector<float> result(texels_.size() * 3, 0.f);
  for (const int index : covered_) {
    const Texel& texel = texels_[index];
    const std::array<int, 3>& face = faces_[texel.triangle];
    const Eigen::Vector3f point = texel.barycentric[0] * vertices[face[0]] + texel.barycentric[1] * vertices[face[1]] +
                                  texel.barycentric[2] * vertices[face[2]];
    float* target = result.data() + static_cast<size_t>(index) * 3;
    target[0] = point.x(), target[1] = point.y(), target[2] = point.z();
  }
  return result;
}

std::vector<float> joint_masks(const BodyModel& body, int resolution) {
  const UvAtlas atlas(body, resolution);
  const size_t joints = static_cast<size_t>(body.joint_count()) - 1;
  std::vector<float> masks(static_cast<size_t>(resolution) * resolution * joints, 0.f);
  for (const int index : atlas.covered()) {
    const Texel& texel = atlas.texels()[index];
    for (int k = 0; k < 3; ++k) {
      if (!(texel.barycentric[k] > 0)) continue;
      for (const JointWeight& share : body.skinning_weights(body.faces()[texel.triangle][k])) {
        if (share.joint > 0) masks[index * joints + share.joint - 1] = 1.f;
      }
    }
  }
  return masks;
}

}  // namespace degas
