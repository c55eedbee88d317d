#include "model/data/mannequin_renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <thread>

#include "model/data/depth_buffer.h"

namespace degas {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using Eigen::Vector4f;

/// Twice the signed area of (a, b, p).
float edge(const ScreenVertex& a, const ScreenVertex& b, float x, float y) {
  return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
}

/// sRGB transfer curve of a linear value, tabulated; values above 1 saturate smoothly.
uint8_t encode(float linear) {
  static const std::vector<uint8_t> table = [] {
    std::vector<uint8_t> values(4096);
    for (int i = 0; i < 4096; ++i) {
      const double x = i / 2047.5;  // the table reaches 2
      const double y = x < 0.7 ? x : 0.7 + 0.3 * (1 - std::exp(-(x - 0.7) / 0.3));
      const double s = y <= 0.0031308 ? 12.92 * y : 1.055 * std::pow(y, 1 / 2.4) - 0.055;
      values[i] = static_cast<uint8_t>(std::lround(255 * std::min(1.0, s)));
    }
    return values;
  }();
  return table[std::clamp(static_cast<int>(linear * 2047.5F + 0.5F), 0, 4095)];
}

/// Colour of one sample: diffuse light on the texture and a highlight of the key light.
Vector3f shade(const LitScene& scene, const Vector3f& eye, const std::vector<ScreenVertex>& screen, int triangle,
               float x, float y) {
  const Eigen::Vector3i& t = (*scene.triangles)[triangle];
  const ScreenVertex &a = screen[t[0]], &b = screen[t[1]], &c = screen[t[2]];
  float wa = edge(b, c, x, y) / a.z, wb = edge(c, a, x, y) / b.z, wc = edge(a, b, x, y) / c.z;
  const float total = 1 / (wa + wb + wc);
  wa *= total;
  wb *= total;
  wc *= total;
  const auto& uv = (*scene.texture_coordinates)[triangle];
  const Vector2f place = wa * uv[0] + wb * uv[1] + wc * uv[2];
  const Vector4f texel = scene.texture->sample(place.x(), place.y());
  const Vector3f light = wa * scene.irradiance[t[0]] + wb * scene.irradiance[t[1]] + wc * scene.irradiance[t[2]];
  Vector3f color = texel.head<3>().cwiseProduct(light);
  if (texel[3] > 0.002F) {
    const Vector3f normal =
        (wa * scene.normals[t[0]] + wb * scene.normals[t[1]] + wc * scene.normals[t[2]]).normalized();
    const Vector3f position = wa * scene.positions[t[0]] + wb * scene.positions[t[1]] + wc * scene.positions[t[2]];
    const Vector3f half = ((eye - position).normalized() + scene.key_direction).normalized();
    const float aligned = std::max(0.0F, normal.dot(half));
    const float power = texel[3] > 0.5F ? 220.0F : 24.0F;  // wet eyes against skin, leather and hair
    color += (texel[3] * std::pow(aligned, power)) * light;
  }
  return color;
}

}  // namespace

Vector4f MannequinTexture::sample(float u, float v) const {
  const float x = std::clamp(u * static_cast<float>(size) - 0.5F, 0.0F, static_cast<float>(size) - 1.001F);
  const float y = std::clamp((1 - v) * static_cast<float>(size) - 0.5F, 0.0F, static_cast<float>(size) - 1.001F);
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const float fx = x - static_cast<float>(column), fy = y - static_cast<float>(row);
  const Vector4f* at = texels.data() + static_cast<size_t>(row) * size + column;
  return (1 - fy) * ((1 - fx) * at[0] + fx * at[1]) + fy * ((1 - fx) * at[size] + fx * at[size + 1]);
}

RenderedPicture rasterize(const LitScene& scene, const Camera& camera, int supersampling) {
  DepthBuffer buffer(camera.width * supersampling, camera.height * supersampling);
  const std::vector<ScreenVertex> screen = project(scene.positions, camera, supersampling);
  buffer.draw(screen, *scene.triangles);

  const Vector3f eye = camera.center().cast<float>();
  RenderedPicture picture{camera.width, camera.height, {}, {}};
  picture.rgb.assign(static_cast<size_t>(3) * camera.width * camera.height, 0);
  picture.alpha.assign(static_cast<size_t>(camera.width) * camera.height, 0);
  const int samples = supersampling * supersampling;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      std::array<int, 3> sum{};
      int covered = 0;
      for (int s = 0; s < samples; ++s) {
        const int x = column * supersampling + s % supersampling, y = row * supersampling + s / supersampling;
        const int triangle = buffer.triangle[static_cast<size_t>(y) * buffer.width + x];
        if (triangle < 0) continue;
        ++covered;
        const Vector3f color =
            shade(scene, eye, screen, triangle, static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
        for (int k = 0; k < 3; ++k) sum[k] += encode(color[k]);
      }
      if (covered == 0) continue;
      const size_t at = static_cast<size_t>(row) * camera.width + column;
      picture.alpha[at] = static_cast<uint8_t>((255 * covered + samples / 2) / samples);
      for (int k = 0; k < 3; ++k) picture.rgb[3 * at + k] = static_cast<uint8_t>((sum[k] + samples / 2) / samples);
    }
  }
  return picture;
}

void for_each_parallel(int count, int threads, const std::function<void(int)>& body) {
  std::atomic<int> next{0};
  std::vector<std::exception_ptr> failures(static_cast<size_t>(count));
  const auto work = [&] {
    for (int i = next++; i < count; i = next++) {
      try {
        body(i);
      } catch (...) {
        failures[static_cast<size_t>(i)] = std::current_exception();
      }
    }
  };
  std::vector<std::thread> helpers;
  for (int k = 1; k < std::min(threads, count); ++k) helpers.emplace_back(work);
  work();
  for (auto& helper : helpers) helper.join();
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
}

}  // namespace degas
