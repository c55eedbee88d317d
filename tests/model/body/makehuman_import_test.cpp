#include "model/body/makehuman_import.h"

#include <fstream>
#include <set>
#include <sstream>

#include "host/error.h"
#include "host/io/npz.h"
#include "model/body/body_model.h"
#include "model/body/uv_atlas.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/training_scene.h"
#include "tests/support/test_devices.h"
#include "tests/support/tiny_makehuman.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

MakeHumanSource source_of(const TinyMakeHuman& files) {
  return {files.base, files.rig, files.weights, {{files.shape, 0.5}}, files.targets};
}

/// SMPL-X's joints by the bones that stand for them, in its order.
std::vector<std::string> bones_of_joints() {
  std::vector<std::string> bones = {"spine05",      "upperleg01.L", "upperleg01.R", "spine04",      "lowerleg01.L",
                                    "lowerleg01.R", "spine03",      "foot.L",       "foot.R",       "spine02",
                                    "toe2-1.L",     "toe2-1.R",     "neck01",       "clavicle.L",   "clavicle.R",
                                    "head",         "upperarm01.L", "upperarm01.R", "lowerarm01.L", "lowerarm01.R",
                                    "wrist.L",      "wrist.R",      "jaw",          "eye.L",        "eye.R"};
  for (const char* side : {".L", ".R"}) {
    for (const char* finger : {"finger2", "finger3", "finger5", "finger4", "finger1"}) {
      for (const char* bone : {"-1", "-2", "-3"}) bones.push_back(std::string(finger) + bone + side);
    }
  }
  return bones;
}

/// Texels of a fine atlas by triangle: [0] all, [1] in the top-left quarter.
std::vector<std::array<int, 2>> texel_counts(const BodyModel& body, int resolution) {
  std::vector<std::array<int, 2>> counts(static_cast<size_t>(body.face_count()), {0, 0});
  const UvAtlas atlas(body, resolution);
  for (const int index : atlas.covered()) {
    std::array<int, 2>& count = counts[static_cast<size_t>(atlas.texels()[static_cast<size_t>(index)].triangle)];
    ++count[0];
    count[1] += index / resolution < resolution / 2 && index % resolution < resolution / 2;
  }
  return counts;
}

std::array<Vector2d, 3> texture_corners(const BodyModel& body, int triangle) {
  std::array<Vector2d, 3> corners;
  for (int k = 0; k < 3; ++k) corners[k] = body.texture_coordinates()[body.texture_faces()[triangle][k]];
  return corners;
}

double twice_area(const std::array<Vector2d, 3>& corners) {
  const Vector2d a = corners[1] - corners[0], b = corners[2] - corners[0];
  return a.x() * b.y() - a.y() * b.x();
}

void replace_in(const std::filesystem::path& path, const std::string& from, const std::string& to) {
  std::ifstream stream(path);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  REQUIRE(text.find(from) != text.npos);
  text.replace(text.find(from), from.size(), to);
  std::ofstream(path) << text;
}

}  // namespace

TEST_CASE("a made-up base mesh becomes a body in SMPL-X's joints") {
  const TemporaryFolder folder;
  const TinyMakeHuman files(folder.path());
  const MakeHumanBody made = import_makehuman(source_of(files));
  write_body_npz(folder / "body.npz", made.arrays);
  const BodyModel body = BodyModel::load(folder / "body.npz");
  REQUIRE(body.vertex_count() == 8 * static_cast<int>(files.bones.size()));
  REQUIRE(body.face_count() == body.vertex_count());  // a tube has 8 vertices and 4 quads
  REQUIRE(body.joint_count() == 55);

  // Vertices: shaped by half of the target, on the floor, in metres; tubes in the file's order.
  double floor = 1e9;
  for (const auto& [bone, middle] : files.middles) floor = std::min(floor, middle.y() - 0.8);
  const Vector3d moved = 0.5 * files.shape_offset, floored(moved.x(), -floor, moved.z());
  const std::vector<Vector3d> vertices = body.canonical_vertices({}, {});
  for (size_t i = 0; i < files.bones.size(); ++i) {
    const Vector3d first = files.middles.at(files.bones[i]) + Vector3d(0.5, -0.8, 0) + floored;
    REQUIRE((vertices[8 * i] - 0.1 * first).norm() < 1e-6);
  }
  // Joints: at the heads of their bones, in SMPL-X's tree.
  const std::vector<std::string> bones = bones_of_joints();
  const std::vector<Vector3d> joints = body.joints({});
  for (int j = 0; j < 55; ++j) {
    CAPTURE(j, bones[j]);
    REQUIRE((joints[j] - 0.1 * (files.middles.at(bones[j]) + floored)).norm() < 1e-6);
  }
  const std::vector<int> tree = {-1, 0,  0,  0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  9,  9,  12, 13, 14, 16,
                                 17, 18, 19, 15, 15, 15, 20, 25, 26, 20, 28, 29, 20, 31, 32, 20, 34, 35, 20,
                                 37, 38, 21, 40, 41, 21, 43, 44, 21, 46, 47, 21, 49, 50, 21, 52, 53};
  CHECK(body.parents() == tree);
  // Skinning: two thirds the bone's joint, one third its parent's; bones without a joint count to the one above.
  const auto joint_of = [&](std::string bone) {
    for (;; bone = files.parents.at(bone)) {
      if (bone == "root") return 0;
      if (bone.starts_with("toe")) return bone.ends_with(".L") ? 10 : 11;
      const auto found = std::find(bones.begin(), bones.end(), bone);
      if (found != bones.end()) return static_cast<int>(found - bones.begin());
    }
  };
  for (size_t i = 0; i < files.bones.size(); ++i) {
    const std::string& bone = files.bones[i];
    std::map<int, double> expected;
    expected[joint_of(bone)] += 2. / 3;
    expected[bone == "root" ? 0 : joint_of(files.parents.at(bone))] += 1. / 3;
    const auto weights = body.skinning_weights(static_cast<int>(8 * i) + 3);
    CAPTURE(bone);
    REQUIRE(weights.size() == expected.size());
    for (const JointWeight& share : weights) REQUIRE(share.weight == Approx(expected[share.joint]).margin(1e-6));
  }
  // Expressions: by name, metres, helpers left out.
  CHECK(made.expression_names == std::vector<std::string>{"blink", "jawOpen", "silence"});
  CHECK(body.expression_count() == 100);
  const auto place = [&](const std::string& bone) {
    return 8 * (std::find(files.bones.begin(), files.bones.end(), bone) - files.bones.begin());
  };
  const std::vector<Vector3d> blinking = body.canonical_vertices({}, {1}), open = body.canonical_vertices({}, {0, 2});
  for (int v = 0; v < body.vertex_count(); ++v) {
    const Vector3d blink(v == place("eye.R") ? 0.1 : 0, 0, 0);
    const Vector3d jaw = v == place("jaw") + 2 ? Vector3d(0, -0.1, 0.05) : Vector3d(0, 0, 0);
    REQUIRE((blinking[v] - vertices[v] - blink).norm() < 1e-6);
    REQUIRE((open[v] - vertices[v] - jaw).norm() < 1e-6);
  }
}

TEST_CASE("charts are packed with the head in the top-left quarter, apart and undistorted") {
  const TemporaryFolder folder;
  const TinyMakeHuman files(folder.path());
  write_body_npz(folder / "body.npz", import_makehuman(source_of(files)).arrays);
  const BodyModel body = BodyModel::load(folder / "body.npz");
  constexpr int resolution = 2048;
  const std::vector<std::array<int, 2>> counts = texel_counts(body, resolution);
  const std::vector<int> list = body.head_vertices();
  const std::set<int> head(list.begin(), list.end());
  REQUIRE(head.size() == 8 * 5);  // head, jaw, two eyes, special01
  double rest_scale = 0, head_scale = 0, covered = 0;
  for (int t = 0; t < body.face_count(); ++t) {
    const std::array<Vector2d, 3> corners = texture_corners(body, t);
    const double area = 0.5 * twice_area(corners) * resolution * resolution;
    REQUIRE(area > 0);  // turned perhaps, not mirrored
    // Where charts lay over another the later one would lose texels.
    REQUIRE(counts[t][0] == Approx(area).epsilon(0.1).margin(12));
    const bool is_head = head.contains(body.faces()[t][0]);
    REQUIRE(counts[t][1] == (is_head ? counts[t][0] : 0));
    // Each quad was 0.15 x 0.3 of the old texture; all surfaces are alike, so all quads of a kind have one size.
    const double side = (corners[1] - corners[0]).norm(), diagonal = (corners[2] - corners[0]).norm();
    double& scale = is_head ? head_scale : rest_scale;
    if (scale == 0) scale = t % 2 == 0 ? side / 0.15 : 0;
    if (t % 2 == 0) REQUIRE(side == Approx(0.15 * scale).epsilon(1e-4));
    if (t % 2 == 0) REQUIRE(diagonal == Approx(std::hypot(0.15, 0.3) * scale).epsilon(1e-4));
    covered += area;
  }
  CHECK(covered > 0.4 * resolution * resolution);
}

TEST_CASE("faults of MakeHuman's files name file and key") {
  const TemporaryFolder folder;
  const TinyMakeHuman files(folder.path());
  MakeHumanSource source = source_of(files);
  SECTION("a rig without a bone") {
    replace_in(files.rig, "\"jaw\":", "\"chin\":");
    CHECK_THROWS_WITH(import_makehuman(source), Contains("rig.mhskel: bones: has no 'jaw'"));
  }
  SECTION("a joint without its vertices") {
    replace_in(files.rig, "\"jaw____head\": [", "\"chin____head\": [");
    CHECK_THROWS_WITH(import_makehuman(source), Contains("rig.mhskel: joints: has no key 'jaw____head'"));
  }
  SECTION("a weight of a vertex that is not there") {
    replace_in(files.weights, "0.6", "-0.6");
    CHECK_THROWS_WITH(import_makehuman(source), Contains("weights.mhw: weights: ") && Contains("negative"));
  }
  SECTION("weights of other bones") {
    replace_in(files.weights, "\"jaw\"", "\"chin\"");
    CHECK_THROWS_WITH(import_makehuman(source), Contains("weights.mhw: weights: bone 'chin' hangs on no bone"));
  }
  SECTION("a vertex that nothing moves") {
    std::ofstream(files.weights) << R"({"weights": {"head": [[40, 1]]}})";
    CHECK_THROWS_WITH(import_makehuman(source), Contains("weights.mhw: weights: no bone moves vertex 4"));
  }
  SECTION("a target of another mesh") {
    std::ofstream(files.shape) << "# target\n99999 0 0 1\n";
    CHECK_THROWS_WITH(import_makehuman(source), Contains("shape.target: line 2: moves vertex 99999"));
  }
  SECTION("a target that is none") {
    std::ofstream(files.targets / "broken.target") << "3 0 nan 1\n";
    CHECK_THROWS_WITH(import_makehuman(source), Contains("broken.target: line 1: 'nan' is no finite number"));
  }
  SECTION("no targets") {
    source.targets = folder / "nowhere";
    CHECK_THROWS_WITH(import_makehuman(source), Contains("nowhere: "));
  }
  SECTION("a texture that shrinks to a point") {
    std::istringstream lines(file_text(files.base));
    std::ofstream base(files.base);
    for (std::string line; std::getline(lines, line);)
      base << (line.starts_with("vt ") ? "vt 0.5 0.5" : line) << '\n';
    base.close();
    CHECK_THROWS_WITH(import_makehuman(source), Contains("base.obj: the texture of the ") && Contains("no area"));
  }
  SECTION("a mesh without texture coordinates") {
    source.shapes.clear();
    std::ofstream(files.base) << "v 0 0 0\nv 1 0 0\nv 0 1 0\ng body\nf 1 2 3\n";
    CHECK_THROWS_WITH(import_makehuman(source), Contains("group 'body' has no texture coordinates"));
  }
}

TEST_CASE("MakeHuman's own files give the full-size bodies that others made of them") {
  const std::string data = data_path("data/makehuman/mesh/base.obj");
  if (data.empty()) return;
  const std::filesystem::path root = std::filesystem::path(data).parent_path().parent_path();
  const std::string sex = GENERATE("male", "female");
  const std::string build = sex + "-young-averagemuscle-averageweight-idealproportions.target";
  const TemporaryFolder folder;
  const MakeHumanBody made = import_makehuman(
      {data,
       root / "rig/default.mhskel",
       root / "rig/default_weights.mhw",
       {{root / "targets_macro" / ("caucasian-" + sex + "-young.target"), 1}, {root / "targets_macro" / build, 0.5}},
       root / "targets_arkit"});
  CHECK(made.expression_names.size() == 67);
  write_body_npz(folder / "body.npz", made.arrays);
  const BodyModel body = BodyModel::load(folder / "body.npz"),
                  other = BodyModel::load(data_path("data/bodies/" + sex + ".npz"));
  // Skin and tongue are numbered alike in both; of eyes and teeth the other keeps fewer vertices.
  constexpr int skin = 13380, common = 13606, skin_triangles = 26756;
  const std::vector<Vector3d> mine = body.canonical_vertices({}, {}), theirs = other.canonical_vertices({}, {});
  double largest = 0, largest_weight = 0;
  for (int v = 0; v < common; ++v) {
    largest = std::max(largest, (mine[v] - theirs[v]).norm());
    std::map<int, double> difference;
    for (const JointWeight& share : body.skinning_weights(v)) difference[share.joint] += share.weight;
    for (const JointWeight& share : other.skinning_weights(v)) difference[share.joint] -= share.weight;
    for (const auto& [joint, value] : difference) largest_weight = std::max(largest_weight, std::abs(value));
  }
  CHECK(largest < 1e-6);
  CHECK(largest_weight < 1e-6);
  CHECK(body.parents() == other.parents());
  CHECK(std::equal(body.faces().begin(), body.faces().begin() + skin_triangles, other.faces().begin()));
  CHECK(*std::max_element(body.faces()[0].begin(), body.faces()[0].end()) < skin);
  const std::vector<Vector3d> joints = body.joints({});
  const std::vector<double> listed = NpzFile(data_path("data/bodies/" + sex + ".npz")).read("J").doubles();
  for (int j = 0; j < 55; ++j)
    REQUIRE((joints[j] - Vector3d(Eigen::Map<const Vector3d>(&listed[3 * j]))).norm() < 1e-6);

  // As full as the atlas that the others packed, the head where it belongs.
  constexpr int resolution = 512;
  const std::vector<int> list = body.head_vertices();
  const std::set<int> head(list.begin(), list.end());
  int all = 0, head_all = 0, head_quarter = 0;
  const std::vector<std::array<int, 2>> counts = texel_counts(body, resolution);
  for (int t = 0; t < body.face_count(); ++t) {
    const std::array<int, 3>& face = body.faces()[t];
    const bool is_head = head.contains(face[0]) && head.contains(face[1]) && head.contains(face[2]);
    all += counts[t][0];
    if (is_head) head_all += counts[t][0], head_quarter += counts[t][1];
  }
  CHECK(head_quarter > 0.99 * head_all);
  CHECK(all >= static_cast<int>(UvAtlas(other, resolution).covered().size()));
}
