#include "model/inspect/silhouette.h"

#include <algorithm>

#include "model/body/body_model.h"
#include "model/data/depth_buffer.h"
#include "model/data/mannequin_renderer.h"
#include "model/loss/metrics.h"

namespace degas {
namespace {

constexpr uint8_t inside = 128;

/// Does the pixel belong to the mask while a neighbour does not?
bool is_border(const Image8& mask, int x, int y) {
  if (*mask.at(x, y) < inside) return false;
  const auto is_outside = [&](int u, int v) {
    return u >= 0 && v >= 0 && u < mask.width && v < mask.height && *mask.at(u, v) < inside;
  };
  return is_outside(x - 1, y) || is_outside(x + 1, y) || is_outside(x, y - 1) || is_outside(x, y + 1);
}

}  // namespace

BodySurface::BodySurface(const std::vector<Eigen::Vector3d>& positions, const std::vector<std::array<int, 3>>& faces) {
  vertices.reserve(positions.size());
  for (const Eigen::Vector3d& position : positions) vertices.push_back(position.cast<float>());
  triangles.reserve(faces.size());
  for (const std::array<int, 3>& face : faces) triangles.emplace_back(face[0], face[1], face[2]);
}

Image8 silhouette(const BodySurface& body, const Camera& camera) {
  DepthBuffer buffer(camera.width, camera.height);
  buffer.draw(project(body.vertices, camera, 1), body.triangles);
  Image8 mask = Image8::black(camera.width, camera.height, 1);
  for (size_t i = 0; i < mask.pixels.size(); ++i) mask.pixels[i] = buffer.triangle[i] >= 0 ? 255 : 0;
  return mask;
}

double overlap(const Image8& a, const Image8& b, const std::optional<Rectangle>& box) {
  const Rectangle part = box ? clipped(*box, a.width, a.height) : Rectangle{0, 0, a.width, a.height};
  int64_t both = 0, either = 0;
  for (int y = part.top; y < part.top + part.height; ++y) {
    const uint8_t *in_a = a.at(0, y), *in_b = b.at(0, y);
    for (int x = part.left; x < part.left + part.width; ++x) {
      both += in_a[x] >= inside && in_b[x] >= inside;
      either += in_a[x] >= inside || in_b[x] >= inside;
    }
  }
  return either > 0 ? static_cast<double>(both) / static_cast<double>(either) : 0;
}

Image8 drawn_over(const Image8& photograph, const Image8& mask, const BodySurface& body, const Camera& camera) {
  LitScene scene;
  scene.positions = body.vertices;
  std::vector<std::array<int, 3>> faces;
  for (const Eigen::Vector3i& t : body.triangles) faces.push_back({t[0], t[1], t[2]});
  std::vector<Eigen::Vector3d> positions;
  for (const Eigen::Vector3f& vertex : body.vertices) positions.push_back(vertex.cast<double>());
  const Eigen::Vector3f eye = camera.center().cast<float>();
  const std::vector<Eigen::Vector3d> normals = vertex_normals(faces, positions);
  for (size_t v = 0; v < normals.size(); ++v) {
    scene.normals.push_back(normals[v].cast<float>());
    const float facing = std::abs(scene.normals[v].dot((eye - scene.positions[v]).normalized()));
    scene.irradiance.push_back((0.1F + 0.9F * facing) * Eigen::Vector3f(0.25F, 0.6F, 0.95F));
  }
  const std::vector<std::array<Eigen::Vector2f, 3>> corners(
      body.triangles.size(), {Eigen::Vector2f::Zero(), Eigen::Vector2f::Zero(), Eigen::Vector2f::Zero()});
  const MannequinTexture white{2, std::vector<Eigen::Vector4f>(4, Eigen::Vector4f(1, 1, 1, 0))};
  scene.triangles = &body.triangles;
  scene.texture_coordinates = &corners;
  scene.texture = &white;
  const RenderedPicture rendered = rasterize(scene, camera, 1);

  Image8 out = photograph;
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      const size_t i = static_cast<size_t>(y) * static_cast<size_t>(out.width) + static_cast<size_t>(x);
      uint8_t* pixel = out.at(x, y);
      if (rendered.alpha[i] > 0) {
        for (size_t c = 0; c < 3; ++c) pixel[c] = static_cast<uint8_t>((pixel[c] + rendered.rgb[3 * i + c]) / 2);
      }
      if (mask.empty() || !is_border(mask, x, y)) continue;
      pixel[0] = 255;
      pixel[1] = 140;
      pixel[2] = 0;
    }
  }
  return out;
}

}  // namespace degas
