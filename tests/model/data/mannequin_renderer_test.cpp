#include "model/data/mannequin_renderer.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tests/support/test_devices.h"

using namespace degas;
using Eigen::Vector3f;

namespace {

using std::numbers::pi;

/// A mesh that owns what a LitScene refers to.
struct TestMesh {
  LitScene scene;
  std::vector<Eigen::Vector3i> triangles;
  std::vector<std::array<Eigen::Vector2f, 3>> coordinates;
  MannequinTexture texture;

  void finish() {
    scene.triangles = &triangles;
    scene.texture_coordinates = &coordinates;
    scene.texture = &texture;
    scene.irradiance.assign(scene.positions.size(), Vector3f::Ones());
    if (coordinates.empty()) coordinates.resize(triangles.size(), {Eigen::Vector2f(0, 0), {0, 0}, {0, 0}});
    if (texture.size == 0) texture = {2, std::vector<Eigen::Vector4f>(4, Eigen::Vector4f(0.5F, 0.5F, 0.5F, 0))};
  }
  void add_sphere(const Vector3f& center, float radius, int rings = 96) {
    const int first = static_cast<int>(scene.positions.size()), around = 2 * rings;
    for (int r = 0; r <= rings; ++r) {
      for (int a = 0; a <= around; ++a) {
        const double theta = pi * r / rings, phi = 2 * pi * a / around;
        const Vector3f n =
            Eigen::Vector3d(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi))
                .cast<float>();
        scene.positions.push_back(center + radius * n);
        scene.normals.push_back(n);
      }
    }
    for (int r = 0; r < rings; ++r) {
      for (int a = 0; a < around; ++a) {
        const int v = first + r * (around + 1) + a;
        triangles.emplace_back(v, v + 1, v + around + 1);
        triangles.emplace_back(v + 1, v + around + 2, v + around + 1);
      }
    }
  }
};

/// At the origin, looking along +z with y down (OpenCV).
Camera simple_camera() {
  Camera camera;
  camera.width = 161;
  camera.height = 120;
  camera.fx = camera.fy = 150;
  camera.cx = 70.3;
  camera.cy = 64.1;
  return camera;
}

double area_of(const RenderedPicture& picture) {
  double area = 0;
  for (const uint8_t alpha : picture.alpha) area += alpha / 255.0;
  return area;
}

}  // namespace

TEST_CASE("a sphere's silhouette has the area and centre of its perspective ellipse") {
  const Eigen::Vector3d center(0.25, -0.2, 2.0);
  const double radius = 0.4;
  TestMesh mesh;
  mesh.add_sphere(center.cast<float>(), static_cast<float>(radius));
  mesh.finish();
  const Camera camera = simple_camera();
  const RenderedPicture picture = rasterize(mesh.scene, camera, 3);
  // The cone of tangents x^T Q x = 0 with Q = c c^T - (|c|^2 - r^2) I, cut by the plane z = 1.
  const Eigen::Matrix3d cone =
      center * center.transpose() - (center.squaredNorm() - radius * radius) * Eigen::Matrix3d::Identity();
  const Eigen::Matrix2d quadratic = cone.topLeftCorner<2, 2>();
  const Eigen::Vector2d middle = -quadratic.inverse() * cone.topRightCorner<2, 1>();
  const double level = cone.determinant() / quadratic.determinant();
  const double area = pi * std::abs(level) / std::sqrt(quadratic.determinant()) * camera.fx * camera.fy;
  CHECK(area_of(picture) == Approx(area).epsilon(0.004));
  double u = 0, v = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      u += picture.alpha[y * picture.width + x] / 255.0 * (x + 0.5);
      v += picture.alpha[y * picture.width + x] / 255.0 * (y + 0.5);
    }
  }
  CHECK(u / area_of(picture) == Approx(camera.fx * middle.x() + camera.cx).margin(0.05));
  CHECK(v / area_of(picture) == Approx(camera.fy * middle.y() + camera.cy).margin(0.05));
}

TEST_CASE("texture coordinates are interpolated in perspective") {
  // A floor-like plane through the view; the texture is black up to u = 1/2 and white beyond.
  TestMesh mesh;
  mesh.scene.positions = {{-1, -0.5F, 1}, {-1, 0.5F, 1}, {3, 0.5F, 5}, {3, -0.5F, 5}};
  mesh.scene.normals.assign(4, Vector3f(0, 0, -1));
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  mesh.coordinates = {{Eigen::Vector2f(0, 0), {1, 1}, {0, 1}}, {Eigen::Vector2f(0, 0), {1, 0}, {1, 1}}};
  mesh.texture.size = 512;
  for (int i = 0; i < 512 * 512; ++i) {
    const float white = i % 512 < 256 ? 0.0F : 1.0F;
    mesh.texture.texels.emplace_back(white, white, white, 0.0F);
  }
  mesh.finish();
  Camera camera = simple_camera();
  camera.cx = 150;
  camera.width = 300;
  RenderedPicture picture = rasterize(mesh.scene, camera, 3);
  if (area_of(picture) == 0) {  // the other side faces the camera
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
    for (auto& c : mesh.coordinates) std::swap(c[1], c[2]);
    picture = rasterize(mesh.scene, camera, 3);
  }
  const int row = 64;
  int edge = -1;
  for (int x = 0; x + 1 < picture.width && edge < 0; ++x) {
    const bool dark =
        picture.rgb[3 * (row * picture.width + x)]<60, next = picture.rgb[3 * (row * picture.width + x + 1)]> 60;
    if (picture.alpha[row * picture.width + x] == 255 && dark && next) edge = x + 1;
  }
  // Halfway along the plane is (1, 0, 3): u = fx / 3 + cx. Affine interpolation would put it at 45 left of the centre.
  CHECK(std::abs(edge - (camera.fx / 3 + camera.cx)) <= 1.0);
}

TEST_CASE("nearer surfaces hide farther ones, back faces and what is behind the camera do not show") {
  TestMesh near_only, both;
  near_only.add_sphere({0, 0, 2}, 0.3F, 24);
  near_only.finish();
  both.add_sphere({0, 0, 4}, 0.3F, 24);
  both.add_sphere({0, 0, 2}, 0.3F, 24);
  both.add_sphere({0, 0, -2}, 0.3F, 24);
  both.add_sphere({0, 0, 0}, 0.2F, 24);  // around the camera: inner sides face it
  both.finish();
  const RenderedPicture a = rasterize(near_only.scene, simple_camera(), 2),
                        b = rasterize(both.scene, simple_camera(), 2);
  CHECK(a.rgb == b.rgb);
  CHECK(a.alpha == b.alpha);
  CHECK(area_of(a) > 500);
}

TEST_CASE("colours are premultiplied by alpha") {
  TestMesh mesh;
  mesh.add_sphere({0, 0, 2}, 0.4F);
  mesh.finish();
  const RenderedPicture picture = rasterize(mesh.scene, simple_camera(), 3);
  int partial = 0;
  for (size_t i = 0; i < picture.alpha.size(); ++i) {
    for (int k = 0; k < 3; ++k) REQUIRE(picture.rgb[3 * i + k] <= picture.alpha[i]);
    if (picture.alpha[i] == 0 || picture.alpha[i] == 255) continue;
    ++partial;
    CHECK(picture.rgb[3 * i] == Approx(188.0 * picture.alpha[i] / 255).margin(1));  // sRGB of one half is 188
  }
  CHECK(partial > 50);
}

TEST_CASE("a light throws a shadow where geometry says, and facing follows the cosine") {
  // A small sphere between the light and a large one.
  TestMesh mesh;
  mesh.add_sphere({0, 0, 0}, 0.5F, 64);
  const size_t large = mesh.scene.positions.size();
  mesh.add_sphere({0, 0.9F, 0}, 0.15F, 32);
  mesh.finish();
  light_scene(mesh.scene, mesh.triangles, {{Vector3f::UnitY(), Vector3f(0.5F, 0.25F, 1.0F)}}, 2);
  int shadowed = 0, lit = 0;
  for (size_t v = 0; v < large; ++v) {
    const Vector3f& p = mesh.scene.positions[v];
    const float aside = std::hypot(p.x(), p.z()), light = mesh.scene.irradiance[v].x();
    if (p.y() < -0.02F) CHECK(light == 0);
    if (p.y() < 0.05F) continue;
    if (aside < 0.135F) {
      CHECK(light == 0);
      ++shadowed;
    } else if (aside > 0.165F) {
      CHECK(light == Approx(0.5F * p.y() / 0.5F).margin(1e-4));
      CHECK(mesh.scene.irradiance[v].z() == Approx(2 * light));
      ++lit;
    }
  }
  CHECK(shadowed > 100);
  CHECK(lit > 1000);
}

TEST_CASE("what bodies of a parallel loop throw is thrown when all are done, the first of them") {
  const int threads = GENERATE(1, 3);
  std::vector<int> done(20, 0);
  CHECK_THROWS_WITH(for_each_parallel(20, threads,
                                      [&](int i) {
                                        done[static_cast<size_t>(i)] = 1;
                                        if (i % 7 == 5) throw std::runtime_error(std::to_string(i));
                                      }),
                    "5");
  CHECK(done == std::vector<int>(20, 1));
}
