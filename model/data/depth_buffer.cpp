#include "model/data/depth_buffer.h"

#include <algorithm>
#include <cmath>

namespace degas {

std::vector<ScreenVertex> project(const std::vector<Eigen::Vector3f>& positions, const Camera& camera,
                                  int supersampling) {
  std::vector<ScreenVertex> screen(positions.size());
  const Eigen::Matrix3f rotation = camera.rotation.cast<float>();
  const Eigen::Vector3f translation = camera.translation.cast<float>();
  const auto fx = static_cast<float>(camera.fx * supersampling), fy = static_cast<float>(camera.fy * supersampling);
  const auto cx = static_cast<float>(camera.cx * supersampling), cy = static_cast<float>(camera.cy * supersampling);
  for (size_t v = 0; v < screen.size(); ++v) {
    const Eigen::Vector3f p = rotation * positions[v] + translation;
    screen[v] = {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy, p.z()};
  }
  return screen;
}

DepthBuffer::DepthBuffer(int buffer_width, int buffer_height) : width(buffer_width), height(buffer_height) {
  inverse_depth.assign(static_cast<size_t>(width) * height, 0.0F);
  triangle.assign(inverse_depth.size(), -1);
}

void DepthBuffer::draw(const std::vector<ScreenVertex>& screen, const std::vector<Eigen::Vector3i>& triangles) {
  constexpr float near_plane = 0.05F;
  for (size_t t = 0; t < triangles.size(); ++t) {
    const ScreenVertex &a = screen[triangles[t][0]], &b = screen[triangles[t][1]], &c = screen[triangles[t][2]];
    if (!(a.z > near_plane && b.z > near_plane && c.z > near_plane)) continue;
    const float area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (!(area < 0)) continue;  // y points down: outer faces turn the other way round
    // Samples are compared at their centres; the bounds are clamped before they become whole numbers, which huge
    // triangles do not fit in.
    const auto first = [](float low, int size) {
      return static_cast<int>(std::clamp(std::ceil(low - 0.5F), 0.0F, static_cast<float>(size)));
    };
    const auto last = [](float high, int size) {
      return static_cast<int>(std::clamp(std::floor(high - 0.5F), -1.0F, static_cast<float>(size - 1)));
    };
    const int left = first(std::min({a.x, b.x, c.x}), width), right = last(std::max({a.x, b.x, c.x}), width);
    const int top = first(std::min({a.y, b.y, c.y}), height), bottom = last(std::max({a.y, b.y, c.y}), height);
    // Barycentric weights of b and c, and the inverse depth, as planes over the samples (anchored at a).
    const float scale = 1 / area;
    const float b_x = (c.y - a.y) * scale, b_y = -(c.x - a.x) * scale;
    const float c_x = -(b.y - a.y) * scale, c_y = (b.x - a.x) * scale;
    const float at_a = 1 / a.z, slope_b = 1 / b.z - at_a, slope_c = 1 / c.z - at_a;
    for (int y = top; y <= bottom; ++y) {
      const float dy = static_cast<float>(y) + 0.5F - a.y;
      const size_t line = static_cast<size_t>(y) * width;
      for (int x = left; x <= right; ++x) {
        const float dx = static_cast<float>(x) + 0.5F - a.x;
        const float wb = b_x * dx + b_y * dy, wc = c_x * dx + c_y * dy;
        if (wb < 0 || wc < 0 || wb + wc > 1) continue;
        const float inverse = at_a + wb * slope_b + wc * slope_c;
        if (inverse <= inverse_depth[line + x]) continue;
        inverse_depth[line + x] = inverse;
        triangle[line + x] = static_cast<int>(t);
      }
    }
  }
}

}  // namespace degas
