#include <Eigen/Geometry>
#include <filesystem>
#include <set>

#include "host/io/npz.h"
#include "model/body/body_model.h"
#include "model/data/mannequin_clothes.h"
#include "model/data/mannequin_motion.h"
#include "tests/support/test_devices.h"

using namespace degas;

namespace {

const MannequinBody& built_body() {
  static const MannequinBody built = build_mannequin();
  return built;
}

bool on_head(MannequinChart chart) {
  return static_cast<int>(chart) <= static_cast<int>(MannequinChart::RightEyeRim);
}

}  // namespace

TEST_CASE("the mannequin is a person of normal size on the floor, left and right alike") {
  Eigen::AlignedBox3d box;
  for (const auto& p : built_body().mesh.vertices) box.extend(p);
  CHECK(box.min().y() > -0.01);
  CHECK(box.min().y() < 0.02);
  CHECK(box.max().y() > 1.70);
  CHECK(box.max().y() < 1.85);
  CHECK(box.min().x() == Approx(-box.max().x()).margin(1e-6));
  CHECK(built_body().mesh.vertices.size() > 6000);
  CHECK(built_body().mesh.vertices.size() < 12500);
  // Inside is volume: a closed, outward surface of 60 to 100 litres (eyes, teeth and cavity hardly count).
  double volume = 0;
  for (const auto& t : built_body().mesh.triangles) {
    const auto& v = built_body().mesh.vertices;
    volume += v[t[0]].dot(v[t[1]].cross(v[t[2]])) / 6;
  }
  CHECK(volume > 0.060);
  CHECK(volume < 0.100);
}

TEST_CASE("the skin is one surface: every edge of it has two triangles, turned alike") {
  std::map<std::pair<int, int>, int> edges;
  const auto& mesh = built_body().mesh;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    const MannequinChart chart = mesh.triangle_charts[i];
    const bool loose = chart == MannequinChart::UpperTeeth || chart == MannequinChart::LowerTeeth ||
                       chart == MannequinChart::LeftEye || chart == MannequinChart::RightEye;
    if (loose) continue;
    for (int k = 0; k < 3; ++k) ++edges[{mesh.triangles[i][k], mesh.triangles[i][(k + 1) % 3]}];
  }
  int doubled = 0, open = 0;
  for (const auto& [edge, count] : edges) {
    doubled += count != 1;
    open += edges.count({edge.second, edge.first}) == 0;
  }
  CHECK(doubled == 0);
  CHECK(open == 24);  // where the lids' rims end behind the eyes: 12 edges each
}

TEST_CASE("skinning weights and joint regressor are convex or affine combinations") {
  const auto& built = built_body();
  CHECK((built.weights.rowwise().sum().array() - 1).abs().maxCoeff() < 1e-5);
  CHECK(built.weights.minCoeff() >= 0);
  CHECK((built.joint_regressor.rowwise().sum().array() - 1).abs().maxCoeff() < 1e-5);
  Eigen::MatrixXd vertices(built.mesh.vertices.size(), 3);
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) vertices.row(v) = built.mesh.vertices[v].transpose();
  const Eigen::MatrixXd joints = built.joint_regressor.cast<double>() * vertices;
  for (int j = 0; j < mannequin_joint_count; ++j) {
    CHECK((joints.row(j).transpose() - built.skeleton.joints[j]).norm() < 1e-5);
  }
  for (int j = 0; j < mannequin_joint_count; ++j)
    CHECK(built.weights.col(j).sum() > 0.5F);  // every joint moves something
}

TEST_CASE("the head lies in the top-left quarter of the atlas and nothing else does") {
  const auto& mesh = built_body().mesh;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector2d uv = mesh.texture_vertices[mesh.texture_triangles[i][k]];
      REQUIRE((uv.x() < 0.5 && uv.y() > 0.5) == on_head(mesh.triangle_charts[i]));
      REQUIRE(uv.minCoeff() > 0);
      REQUIRE(uv.maxCoeff() < 1);
    }
  }
}

TEST_CASE("no texel of the atlas belongs to two triangles") {
  constexpr int size = 768;
  std::vector<int> owner(size * size, -1);
  const auto& mesh = built_body().mesh;
  int covered = 0, shared = 0;
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); };
  for (size_t i = 0; i < mesh.texture_triangles.size(); ++i) {
    std::array<Eigen::Vector2d, 3> p;
    Eigen::AlignedBox2d box;
    for (int k = 0; k < 3; ++k) box.extend(p[k] = size * mesh.texture_vertices[mesh.texture_triangles[i][k]]);
    const double area = cross(p[1] - p[0], p[2] - p[0]);
    for (int y = static_cast<int>(box.min().y()); y <= static_cast<int>(box.max().y()); ++y) {
      for (int x = static_cast<int>(box.min().x()); x <= static_cast<int>(box.max().x()); ++x) {
        const Eigen::Vector2d at(x + 0.5, y + 0.5);
        const double a = cross(p[1] - at, p[2] - at) / area, b = cross(p[2] - at, p[0] - at) / area;
        if (a <= 1e-6 || b <= 1e-6 || a + b >= 1 - 1e-6) continue;
        int& texel = owner[y * size + x];
        shared += texel >= 0;
        covered += texel < 0;
        texel = static_cast<int>(i);
      }
    }
  }
  CHECK(shared == 0);
  CHECK(covered > 0.75 * size * size);
}

TEST_CASE("the jaw joint opens the mouth and lids close over the eyes") {
  const auto& built = built_body();
  MannequinPose open;
  open.axis_angles[22] = {0.3, 0, 0};
  const auto rest = pose_body(built, {}), opened = pose_body(built, open);
  double lower = 0, upper = 0;
  for (size_t v = 0; v < rest.size(); ++v) {
    CHECK_FALSE(!(rest[v] - built.mesh.vertices[v]).isZero(1e-6));
    if (std::abs(rest[v].x()) > 0.01 || rest[v].z() < 0.085 || std::abs(rest[v].y() - 1.5665) > 0.006) continue;
    double& moved = built.below_mouth[v] ? lower : upper;
    moved = std::max(moved, rest[v].y() - opened[v].y());
  }
  CHECK(lower > 0.015);
  CHECK(upper < 0.5 * lower);

  MannequinPose shut;
  shut.expression[static_cast<int>(MannequinExpression::LidsClose)] = 1;
  const auto closed = pose_body(built, shut);
  double largest = 0;
  for (size_t v = 0; v < rest.size(); ++v) largest = std::max(largest, (closed[v] - rest[v]).norm());
  CHECK(largest > 0.005);
  CHECK(largest < 0.013);
  // Every expression moves the face by millimetres, and the face only.
  for (int e = 0; e < mannequin_expression_count; ++e) {
    double face = 0;
    for (size_t v = 0; v < rest.size(); ++v) {
      const double moved = built.expressions.block<3, 1>(3 * static_cast<Eigen::Index>(v), e).norm();
      if (rest[v].y() < 1.50 || rest[v].z() < 0) REQUIRE(moved < 1e-6);
      face = std::max(face, moved);
    }
    CHECK(face > 0.002);
    CHECK(face < 0.02);
  }
}

TEST_CASE("the body file has the SMPL-X layout and gives the body back") {
  const auto path = std::filesystem::temp_directory_path() / "degas_mannequin_body_test.npz";
  write_mannequin_body(path, built_body());
  const NpzFile file(path);
  const auto count = static_cast<int64_t>(built_body().mesh.vertices.size());
  const auto vertices = file.read("v_template", {count, 3}).doubles();
  CHECK(vertices[3 * 100 + 1] == Approx(built_body().mesh.vertices[100].y()));
  const auto shapes = file.read("shapedirs", {count, 3, 400}).floats();
  const Eigen::Index row = 3 * 4000;
  for (int e = 0; e < mannequin_expression_count; ++e) {
    CHECK(shapes[static_cast<size_t>(row) * 400 + 300 + e] == built_body().expressions(row, e));
  }
  file.read("posedirs", {count, 3, 486});
  file.read("J_regressor", {55, count});
  file.read("weights", {count, 55});
  CHECK(file.read("kintree_table", {2, 55}).integers()[0] == -1);
  const auto triangles = file.read("f", {-1, 3}), texture_triangles = file.read("ft", triangles.shape);
  CHECK(triangles.integers().size() == 3 * built_body().mesh.triangles.size());
  file.read("vt", {-1, 2});
  for (const char* key : {"hands_meanl", "hands_meanr"}) file.read(key, {45});
  for (const char* key : {"hands_componentsl", "hands_componentsr"}) file.read(key, {45, 45});
  std::filesystem::remove(path);
}

TEST_CASE("the loader of body models poses the written body as the mannequin poses itself") {
  const auto path = std::filesystem::temp_directory_path() / "degas_mannequin_loader_test.npz";
  write_mannequin_body(path, built_body());
  const BodyModel model = BodyModel::load(path);
  std::filesystem::remove(path);
  CHECK(model.shape_count() == 300);
  CHECK(model.expression_count() == 100);
  for (const double time : {0.05, 0.4, 0.77}) {
    const MannequinPose state = mannequin_motion(MannequinSequence::Training, time, 3, built_body().skeleton);
    Pose pose;
    pose.axis_angles.assign(state.axis_angles.begin(), state.axis_angles.end());
    pose.translation = state.translation;
    pose.expression.assign(state.expression.begin(), state.expression.end());
    const auto expected = pose_body(built_body(), state), actual = model.posed_vertices(pose, {}, true);
    REQUIRE(actual.size() == expected.size());
    double largest = 0;
    for (size_t v = 0; v < actual.size(); ++v) largest = std::max(largest, (actual[v] - expected[v]).norm());
    CHECK(largest < 2e-5);  // float32 file
  }
}
