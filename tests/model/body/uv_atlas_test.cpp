#include "model/body/uv_atlas.h"

#include <set>

#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"
#include "tests/support/tiny_body.h"

using namespace degas;
using namespace degas::test;
using Eigen::Vector2d;

namespace {

BodyModel tiny_body() {
  const TemporaryFolder folder;
  write_tiny_body(folder / "body.npz");
  return BodyModel::load(folder / "body.npz");
}

/// Barycentrics lie inside, sum to 1 and lead back to the texel's centre.
void check_texels(const BodyModel& body, const UvAtlas& atlas) {
  const int resolution = atlas.resolution();
  size_t covered = 0;
  double farthest = 0, worst_sum = 0;
  float lowest = 1;
  for (size_t i = 0; i < atlas.texels().size(); ++i) {
    const Texel& texel = atlas.texels()[i];
    if (texel.triangle < 0) continue;
    REQUIRE(atlas.covered().at(covered++) == static_cast<int>(i));
    Vector2d uv = Vector2d::Zero();
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      lowest = std::min(lowest, texel.barycentric[k]);
      sum += texel.barycentric[k];
      uv += texel.barycentric[k] * body.texture_coordinates()[body.texture_faces()[texel.triangle][k]];
    }
    const Vector2d center((i % resolution + 0.5) / resolution, 1 - (i / resolution + 0.5) / resolution);
    farthest = std::max(farthest, (uv - center).norm());
    worst_sum = std::max(worst_sum, std::abs(sum - 1));
  }
  CHECK(covered == atlas.covered().size());
  CHECK(lowest >= 0);
  CHECK(worst_sum < 1e-6);
  CHECK(farthest < 1e-6);
}

}  // namespace

TEST_CASE("every texel whose centre lies in a triangle is covered, with the right barycentrics") {
  const BodyModel body = tiny_body();
  for (const int resolution : {1, 7, 10, 64, 133}) {
    CAPTURE(resolution);
    const UvAtlas atlas(body, resolution);
    check_texels(body, atlas);
    // The triangles fill the square 0.1 .. 0.9 without holes.
    size_t inside = 0;
    for (int i = 0; i < resolution * resolution; ++i) {
      const double u = (i % resolution + 0.5) / resolution, v = 1 - (i / resolution + 0.5) / resolution;
      const double from_edge = 0.4 - std::max(std::abs(u - 0.5), std::abs(v - 0.5));
      if (from_edge > 1e-6) {
        ++inside;
        CHECK(atlas.texels()[i].triangle >= 0);
      } else if (from_edge < -1e-6) {
        CHECK(atlas.texels()[i].triangle < 0);
      }
    }
    CHECK(inside > 0);
  }
}

TEST_CASE("maps interpolate vertices and are zero elsewhere") {
  const BodyModel body = tiny_body();
  const UvAtlas atlas(body, 33);
  // Positions on the flat grid are 1.25 (uv - 0.1); a linear function of the vertices stays linear.
  const std::vector<Eigen::Vector3d> vertices = body.canonical_vertices({}, {});
  std::vector<float> values;
  for (const Eigen::Vector3d& vertex : vertices) {
    values.push_back(static_cast<float>(vertex.x()));
    values.push_back(static_cast<float>(3 - vertex.y()));
  }
  const std::vector<float> map = atlas.map(values, 2), positions = atlas.map(vertices);
  REQUIRE(map.size() == 33 * 33 * 2);
  REQUIRE(positions.size() == 33 * 33 * 3);
  for (int i = 0; i < 33 * 33; ++i) {
    const double x = 1.25 * ((i % 33 + 0.5) / 33 - 0.1), y = 1.25 * (1 - (i / 33 + 0.5) / 33 - 0.1);
    const bool covered = atlas.texels()[i].triangle >= 0;
    CHECK(map[2 * i] == Approx(covered ? x : 0).margin(1e-5));
    CHECK(map[2 * i + 1] == Approx(covered ? 3 - y : 0).margin(1e-5));
    CHECK(positions[3 * i] == Approx(covered ? x : 0).margin(1e-5));
    CHECK(positions[3 * i + 1] == Approx(covered ? y : 0).margin(1e-5));
    if (!covered) CHECK(positions[3 * i + 2] == 0);
  }
  CHECK_THROWS_AS(atlas.map(values, 3), std::logic_error);
  CHECK_THROWS_AS(atlas.map(std::vector<Eigen::Vector3d>()), std::logic_error);
}

TEST_CASE("a joint mask is where its joint has weight") {
  const BodyModel body = tiny_body();
  const int resolution = 16, joints = 54;
  const UvAtlas atlas(body, resolution);
  const std::vector<float> masks = joint_masks(body, resolution);
  REQUIRE(masks.size() == static_cast<size_t>(resolution * resolution * joints));
  size_t ones = 0;
  for (int joint = 1; joint < 55; ++joint) {
    std::vector<float> weight(body.vertex_count(), 0.f);
    for (int v = 0; v < body.vertex_count(); ++v) {
      for (const JointWeight& share : body.skinning_weights(v)) {
        if (share.joint == joint) weight[v] = static_cast<float>(share.weight);
      }
    }
    const std::vector<float> map = atlas.map(weight, 1);
    for (int i = 0; i < resolution * resolution; ++i) {
      if (masks[i * joints + joint - 1] != (map[i] > 0 ? 1.f : 0.f)) FAIL("joint " << joint << " at " << i);
      ones += map[i] > 0;
    }
  }
  CHECK(ones > 1000);
  CHECK(ones < masks.size());
}

TEST_CASE("an atlas without a covered texel is refused") {
  const TemporaryFolder folder;
  auto arrays = tiny_body_arrays();
  arrays["vt"] = NpyArray::from({9, 2}, std::vector<float>(18, 0.3f));
  write_npz(folder / "flat.npz", arrays);
  CHECK_THROWS_WITH(UvAtlas(BodyModel::load(folder / "flat.npz"), 32),
                    Catch::Contains("flat.npz: 'vt' covers no texel of a 32x32 atlas"));
}

TEST_CASE("a full-size body's atlas at working resolutions, the head in the top-left quarter") {
  const std::string path = data_path("data/bodies/male.npz");
  if (path.empty()) return;
  const BodyModel body = BodyModel::load(path);
  for (const int resolution : {64, 256, 512}) {
    CAPTURE(resolution);
    const UvAtlas atlas(body, resolution);
    check_texels(body, atlas);
    CHECK(atlas.covered().size() > 0.5 * resolution * resolution);
    const std::vector<int> list = body.head_vertices();
    const std::set<int> head(list.begin(), list.end());
    int quarter = 0, all = 0;
    for (const int index : atlas.covered()) {
      const std::array<int, 3>& face = body.faces()[atlas.texels()[index].triangle];
      if (!head.contains(face[0]) || !head.contains(face[1]) || !head.contains(face[2])) continue;
      ++all;
      quarter += index / resolution < resolution / 2 && index % resolution < resolution / 2;
    }
    CHECK(quarter > 0.8 * all);
  }
}
