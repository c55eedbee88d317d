#include "model/gaussians/base_maps.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"
#include "tests/support/tiny_body.h"

using namespace degas;
using namespace degas::test;
using Eigen::Vector3d;

namespace {

BodyModel tiny_body() {
  const TemporaryFolder folder;
  write_tiny_body(folder / "body.npz");
  return BodyModel::load(folder / "body.npz");
}

Vector3d column(const BaseMaps& maps, size_t gaussian, int axis) {
  const float* q = maps.rotations.data() + 4 * gaussian;
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix().col(axis);
}

Vector3d position(const BaseMaps& maps, size_t gaussian) {
  const float* p = maps.positions.data() + 3 * gaussian;
  return {p[0], p[1], p[2]};
}

void check_shapes(const BaseMaps& maps, const UvAtlas& atlas) {
  const size_t count = atlas.covered().size(), places = count * maps.influences;
  CHECK(maps.resolution == atlas.resolution());
  CHECK(std::vector<int>(maps.covered.begin(), maps.covered.end()) == atlas.covered());
  REQUIRE(maps.positions.size() == 3 * count);
  REQUIRE(maps.rotations.size() == 4 * count);
  REQUIRE(maps.log_scales.size() == 3 * count);
  REQUIRE(maps.joints.size() == places);
  REQUIRE(maps.weights.size() == places);
}

}  // namespace

TEST_CASE("positions are on the surface, quaternions unit, z along the interpolated normals") {
  const BodyModel body = tiny_body();
  const UvAtlas atlas(body, 40);
  const std::vector<double> betas = {1, -0.5};
  const BaseMaps maps = make_base_maps(body, betas, atlas, 8, 1e-4);
  check_shapes(maps, atlas);
  const std::vector<Vector3d> vertices = body.canonical_vertices(betas, {});
  std::vector<Vector3d> normals(vertices.size(), Vector3d::Zero());
  for (const std::array<int, 3>& face : body.faces()) {
    const Vector3d normal = (vertices[face[1]] - vertices[face[0]]).cross(vertices[face[2]] - vertices[face[0]]);
    for (const int v : face) normals[v] += normal;
  }
  for (size_t g = 0; g < maps.covered.size(); ++g) {
    const Texel& texel = atlas.texels()[maps.covered[g]];
    Vector3d point = Vector3d::Zero(), normal = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const int v = body.faces()[texel.triangle][k];
      point += texel.barycentric[k] * vertices[v];
      normal += texel.barycentric[k] * normals[v].normalized();
    }
    const float* q = maps.rotations.data() + 4 * g;
    CHECK(Eigen::Vector4f(q[0], q[1], q[2], q[3]).norm() == Approx(1).margin(1e-6));
    CHECK(q[0] >= 0);
    CHECK((position(maps, g) - point).norm() < 1e-6);
    CHECK((column(maps, g, 2) - normal.normalized()).norm() < 1e-5);
    CHECK(column(maps, g, 0).x() > 0.7);  // the grid's u runs along x
  }
}

TEST_CASE("scales are the texels' size in the plane and thin across") {
  const TemporaryFolder folder;
  auto arrays = tiny_body_arrays();
  std::vector<double> flat = arrays.at("v_template").doubles();
  for (size_t i = 2; i < flat.size(); i += 3) flat[i] = 0;
  arrays["v_template"] = NpyArray::from({9, 3}, flat);
  write_npz(folder / "flat.npz", arrays);
  const BodyModel body = BodyModel::load(folder / "flat.npz");
  const UvAtlas atlas(body, 40);
  const BaseMaps maps = make_base_maps(body, {}, atlas, 8, 2e-4);
  const double texel = 1.25 / 40;  // metres: 0.8 of the texture is 1 m
  int inner = 0;
  for (size_t g = 0; g < maps.covered.size(); ++g) {
    CHECK(maps.log_scales[3 * g] == maps.log_scales[3 * g + 1]);
    CHECK(maps.log_scales[3 * g + 2] == Approx(std::log(2e-4)));
    const double scale = std::exp(maps.log_scales[3 * g]) / texel;
    CHECK((std::abs(scale - 1) < 1e-4 || std::abs(scale - std::sqrt(4. / 3)) < 1e-4));  // a corner has two neighbours
    inner += std::abs(scale - 1) < 1e-4;
  }
  CHECK(inner == static_cast<int>(maps.covered.size()) - 4);
}

TEST_CASE("skinning weights keep the largest joints and sum to one") {
  const BodyModel body = tiny_body();
  const UvAtlas atlas(body, 20);
  const int most = 4;
  for (const SkinningInterpolation skinning : {SkinningInterpolation::Barycentric, SkinningInterpolation::Nearest}) {
    const BaseMaps maps = make_base_maps(body, {}, atlas, most, 1e-4, skinning);
    check_shapes(maps, atlas);
    REQUIRE(maps.influences == most);
    for (size_t g = 0; g < maps.covered.size(); ++g) {
      const Texel& texel = atlas.texels()[maps.covered[g]];
      std::vector<double> dense(55, 0.0);
      int nearest = 0;
      for (int k = 1; k < 3; ++k) nearest = texel.barycentric[k] > texel.barycentric[nearest] ? k : nearest;
      for (int k = 0; k < 3; ++k) {
        const double part = skinning == SkinningInterpolation::Nearest ? k == nearest : texel.barycentric[k];
        for (const JointWeight& share : body.skinning_weights(body.faces()[texel.triangle][k])) {
          dense[share.joint] += part * share.weight;
        }
      }
      std::vector<double> sorted = dense;
      std::sort(sorted.rbegin(), sorted.rend());
      const double kept = sorted[0] + sorted[1] + sorted[2] + sorted[3];
      double sum = 0;
      for (int i = 0; i < most; ++i) {
        const float weight = maps.weights[g * most + i];
        CHECK(weight == Approx(sorted[i] / kept).margin(1e-6));
        if (weight > 0) CHECK(weight == Approx(dense[maps.joints[g * most + i]] / kept).margin(1e-6));
        sum += weight;
      }
      CHECK(sum == Approx(1).margin(1e-6));
    }
  }
  const BaseMaps all = make_base_maps(body, {}, atlas, 55, 1e-4);
  CHECK(all.influences < 55);
  CHECK(all.influences > most);
}

TEST_CASE("base maps of a full-size body are sane") {
  const std::string path = data_path("data/bodies/male.npz");
  if (path.empty()) return;
  const BodyModel body = BodyModel::load(path);
  const UvAtlas atlas(body, 256);
  const BaseMaps maps = make_base_maps(body, {}, atlas, 8, 1e-4);
  check_shapes(maps, atlas);
  const std::vector<Vector3d> vertices = body.canonical_vertices({}, {});
  size_t turned = 0, odd_scales = 0;
  double worst_norm = 0, worst_sum = 0;
  for (size_t g = 0; g < maps.covered.size(); ++g) {
    const int triangle = atlas.texels()[maps.covered[g]].triangle;
    std::array<Vector3d, 3> corners;
    std::array<Eigen::Vector2d, 3> uv;
    for (int k = 0; k < 3; ++k) {
      corners[k] = vertices[body.faces()[triangle][k]];
      uv[k] = body.texture_coordinates()[body.texture_faces()[triangle][k]] * 256;
    }
    const Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    const Eigen::Vector2d a = uv[1] - uv[0], b = uv[2] - uv[0];
    const double texel = std::sqrt(normal.norm() / std::abs(a.x() * b.y() - a.y() * b.x()));  // metres a side
    turned += column(maps, g, 2).dot(normal.normalized()) < 0.5;
    const double ratio = std::exp(maps.log_scales[3 * g]) / texel;
    odd_scales += !(ratio > 1. / 3 && ratio < 3);
    const float* q = maps.rotations.data() + 4 * g;
    worst_norm = std::max<double>(worst_norm, std::abs(Eigen::Vector4f(q[0], q[1], q[2], q[3]).norm() - 1));
    double sum = 0;
    for (int i = 0; i < maps.influences; ++i) sum += maps.weights[g * maps.influences + i];
    worst_sum = std::max(worst_sum, std::abs(sum - 1));
  }
  CHECK(worst_norm < 1e-6);
  CHECK(worst_sum < 1e-6);
  CHECK(turned < 0.01 * maps.covered.size());
  CHECK(odd_scales < 0.02 * maps.covered.size());
}
