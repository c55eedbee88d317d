#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "model/data/mannequin_renderer.h"

namespace degas {
namespace {

using Eigen::Vector3f;

/// Depths along a light's direction on a square grid that covers the scene.
class ShadowMap {
 public:
  static constexpr int size = 448;

  ShadowMap(const std::vector<Vector3f>& positions, const std::vector<Eigen::Vector3i>& casters, const Vector3f& toward)
      : depth_(static_cast<size_t>(size) * size, -std::numeric_limits<float>::max()) {
    const Vector3f helper = std::abs(toward.y()) < 0.9F ? Vector3f::UnitY() : Vector3f::UnitX();
    axes_.row(0) = toward.cross(helper).normalized();
    axes_.row(1) = toward.cross(Vector3f(axes_.row(0))).normalized();
    axes_.row(2) = toward;
    Vector3f low = Vector3f::Constant(std::numeric_limits<float>::max()), high = -low;
    // The lit surface is finer than the casters and lists their vertices first.
    int last = -1;
    for (const auto& t : casters) last = std::max(last, t.maxCoeff());
    std::vector<Vector3f> local(static_cast<size_t>(last + 1));
    for (size_t v = 0; v < local.size(); ++v) {
      local[v] = axes_ * positions[v];
      low = low.cwiseMin(local[v]);
      high = high.cwiseMax(local[v]);
    }
    scale_ = static_cast<float>(size - 4) / std::max(high.x() - low.x(), high.y() - low.y());
    offset_ = Vector3f(2 - low.x() * scale_, 2 - low.y() * scale_, 0);
    for (auto& p : local) p = to_map(p);
    for (const auto& t : casters) draw(local[t[0]], local[t[1]], local[t[2]]);
  }

  /// Share of light that reaches the point, 2x2 comparisons weighted bilinearly.
  float visibility(const Vector3f& position) const {
    const Vector3f p = to_map(axes_ * position);
    const float x = std::clamp(p.x() - 0.5F, 0.0F, size - 1.01F), y = std::clamp(p.y() - 0.5F, 0.0F, size - 1.01F);
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const float fx = x - static_cast<float>(column), fy = y - static_cast<float>(row);
    const float* at = depth_.data() + static_cast<size_t>(row) * size + column;
    const auto lit = [&](float depth) { return depth <= p.z() ? 1.0F : 0.0F; };
    return (1 - fy) * ((1 - fx) * lit(at[0]) + fx * lit(at[1])) +
           fy * ((1 - fx) * lit(at[size]) + fx * lit(at[size + 1]));
  }

 private:
  Vector3f to_map(const Vector3f& local) const {
    return {local.x() * scale_ + offset_.x(), local.y() * scale_ + offset_.y(), local.z()};
  }

  void draw(const Vector3f& a, const Vector3f& b, const Vector3f& c) {
    const float area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
    if (std::abs(area) < 1e-9F) return;
    const int left = static_cast<int>(std::ceil(std::min({a.x(), b.x(), c.x()}) - 0.5F));
    const int right = static_cast<int>(std::floor(std::max({a.x(), b.x(), c.x()}) - 0.5F));
    const int top = static_cast<int>(std::ceil(std::min({a.y(), b.y(), c.y()}) - 0.5F));
    const int bottom = static_cast<int>(std::floor(std::max({a.y(), b.y(), c.y()}) - 0.5F));
    // Barycentric weights of b and c as planes over the map.
    const float scale = 1 / area;
    const float b_x = (c.y() - a.y()) * scale, b_y = -(c.x() - a.x()) * scale;
    const float c_x = -(b.y() - a.y()) * scale, c_y = (b.x() - a.x()) * scale;
    const float slope_b = b.z() - a.z(), slope_c = c.z() - a.z();
    for (int row = top; row <= bottom; ++row) {
      const float y = static_cast<float>(row) + 0.5F - a.y();
      float* line = depth_.data() + static_cast<size_t>(row) * size;
      for (int column = left; column <= right; ++column) {
        const float x = static_cast<float>(column) + 0.5F - a.x();
        const float wb = b_x * x + b_y * y, wc = c_x * x + c_y * y;
        if (wb < 0 || wc < 0 || wb + wc > 1) continue;
        line[column] = std::max(line[column], a.z() + wb * slope_b + wc * slope_c);
      }
    }
  }

  Eigen::Matrix3f axes_;
  Vector3f offset_;
  float scale_ = 1;
  std::vector<float> depth_;
};

}  // namespace

std::vector<DirectionalLight> studio_lights() {
  std::vector<DirectionalLight> lights;
  const auto add_disc = [&](const Vector3f& toward, float radius, int count, const Vector3f& color) {
    const Vector3f across = toward.cross(Vector3f::UnitY()).normalized(), along = across.cross(toward).normalized();
    for (int i = 0; i < count; ++i) {
      const float r = radius * std::sqrt((static_cast<float>(i) + 0.5F) / static_cast<float>(count));
      const float angle = 2.39996323F * static_cast<float>(i);
      lights.push_back({(toward + r * (std::cos(angle) * across + std::sin(angle) * along)).normalized(),
                        color / static_cast<float>(count)});
    }
  };
  add_disc(Vector3f(0.55F, 0.75F, 0.75F).normalized(), 0.22F, 9, Vector3f(0.62F, 0.59F, 0.54F));
  add_disc(Vector3f(-0.80F, 0.35F, 0.50F).normalized(), 0.30F, 5, Vector3f(0.20F, 0.22F, 0.25F));
  add_disc(Vector3f(-0.15F, 0.55F, -0.85F).normalized(), 0.30F, 5, Vector3f(0.34F, 0.34F, 0.36F));
  constexpr int dome = 20;
  for (int i = 0; i < dome; ++i) {
    const float up = (static_cast<float>(i) + 0.5F) / dome, angle = 2.39996323F * static_cast<float>(i);
    const float flat = std::sqrt(1 - up * up);
    lights.push_back({Vector3f(flat * std::cos(angle), up, flat * std::sin(angle)),
                      Vector3f(0.54F, 0.57F, 0.60F) * (2.0F / dome) * (0.6F + 0.4F * up)});
  }
  for (int i = 0; i < 5; ++i) {
    const float angle = 2 * std::numbers::pi_v<float> * (static_cast<float>(i) + 0.25F) / 5;
    lights.push_back({Vector3f(0.75F * std::cos(angle), -0.66F, 0.75F * std::sin(angle)).normalized(),
                      Vector3f(0.17F, 0.155F, 0.14F) / 2.5F});
  }
  return lights;
}

void light_scene(LitScene& scene, const std::vector<Eigen::Vector3i>& casters,
                 const std::vector<DirectionalLight>& lights, int threads) {
  const size_t count = scene.positions.size();
  // One accumulator per light would be large; a light's share is kept as one float per vertex and summed in order.
  std::vector<std::vector<float>> shares(lights.size());
  for_each_parallel(static_cast<int>(lights.size()), threads, [&](int index) {
    const DirectionalLight& light = lights[index];
    const ShadowMap map(scene.positions, casters, light.toward);
    std::vector<float>& share = shares[index];
    share.assign(count, 0.0F);
    for (size_t v = 0; v < count; ++v) {
      const float facing = scene.normals[v].dot(light.toward);
      if (facing <= 0) continue;
      // Off the surface by a few millimetres: the casters are coarser than the lit surface.
      const Vector3f lifted = scene.positions[v] + 0.004F * scene.normals[v] + 0.007F * light.toward;
      share[v] = facing * map.visibility(lifted);
    }
  });
  scene.irradiance.assign(count, Vector3f::Zero());
  for (size_t l = 0; l < lights.size(); ++l) {
    for (size_t v = 0; v < count; ++v) scene.irradiance[v] += shares[l][v] * lights[l].color;
  }
}

}  // namespace degas
