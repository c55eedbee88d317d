#include "model/body/body_model.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <optional>

#include "host/error.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"
#include "tests/support/tiny_body.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;

namespace {

Pose random_pose(int joints, int expressions, unsigned seed) {
  const std::vector<double> values = random_values(3 * joints + 3, seed, -1, 1);
  Pose pose;
  for (int j = 0; j < joints; ++j) pose.axis_angles.emplace_back(values[3 * j], values[3 * j + 1], values[3 * j + 2]);
  pose.axis_angles[3].setZero();
  pose.axis_angles[4] *= 1e-9;
  pose.translation = Eigen::Map<const Vector3d>(values.data() + 3 * joints);
  pose.expression = random_values(expressions, seed + 1, -2, 2);
  return pose;
}

Matrix3d rodrigues(const Vector3d& r) {
  const double angle = r.norm();
  Matrix3d cross;
  cross << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
  if (angle == 0) return Matrix3d::Identity();
  return Matrix3d::Identity() + std::sin(angle) / angle * cross +
         2 * std::pow(std::sin(angle / 2) / angle, 2) * cross * cross;
}

/// Dense loops over the arrays of the file, homogeneous matrices all the way.
struct PlainBody {
  explicit PlainBody(const NpzFile& file)
      : vertices(file.read("v_template").doubles()),
        shapes(file.read("shapedirs").doubles()),
        pose_shapes(file.read("posedirs").doubles()),
        regressor(file.read("J_regressor").doubles()),
        weights(file.read("weights").doubles()),
        parents(file.read("kintree_table").integers()) {
    count = vertices.size() / 3;
    joints = parents.size() / 2;
    columns = shapes.size() / vertices.size();
  }

  std::vector<Vector3d> shaped(int shape_columns, const std::vector<double>& betas,
                               const std::vector<double>& expression) const {
    std::vector<double> sum = vertices;
    for (size_t i = 0; i < sum.size(); ++i) {
      for (size_t b = 0; b < betas.size(); ++b) sum[i] += shapes[i * columns + b] * betas[b];
      for (size_t e = 0; e < expression.size(); ++e) sum[i] += shapes[i * columns + shape_columns + e] * expression[e];
    }
    std::vector<Vector3d> points;
    for (size_t v = 0; v < count; ++v) points.emplace_back(sum[3 * v], sum[3 * v + 1], sum[3 * v + 2]);
    return points;
  }

  std::vector<Vector3d> rest_joints(const std::vector<Vector3d>& shaped) const {
    std::vector<Vector3d> result(joints, Vector3d::Zero());
    for (size_t j = 0; j < joints; ++j) {
      for (size_t v = 0; v < count; ++v) result[j] += regressor[j * count + v] * shaped[v];
    }
    return result;
  }

  std::vector<Matrix4d> chain(const Pose& pose, const std::vector<Vector3d>& rest) const {
    std::vector<Matrix4d> result(joints);
    for (size_t j = 0; j < joints; ++j) {
      Matrix4d local = Matrix4d::Identity();
      local.topLeftCorner<3, 3>() = rodrigues(pose.axis_angles[j]);
      local.topRightCorner<3, 1>() = j == 0 ? rest[0] : Vector3d(rest[j] - rest[parents[j]]);
      result[j] = j == 0 ? local : Matrix4d(result[parents[j]] * local);
    }
    for (Matrix4d& matrix : result) matrix.topRightCorner<3, 1>() += pose.translation;
    return result;
  }

  std::vector<Vector3d> posed(int shape_columns, const Pose& pose, const std::vector<double>& betas) const {
    const std::vector<Vector3d> rest = rest_joints(shaped(shape_columns, betas, {}));
    const std::vector<Matrix4d> frames = chain(pose, rest);
    std::vector<Vector3d> points = shaped(shape_columns, betas, pose.expression);
    const size_t features = 9 * (joints - 1);
    std::vector<double> feature;
    for (size_t j = 1; j < joints; ++j) {
      const Matrix3d offset = rodrigues(pose.axis_angles[j]) - Matrix3d::Identity();
      for (int i = 0; i < 9; ++i) feature.push_back(offset(i / 3, i % 3));
    }
    for (size_t v = 0; v < count; ++v) {
      for (int c = 0; c < 3; ++c) {
        for (size_t p = 0; p < features; ++p) points[v][c] += pose_shapes[(3 * v + c) * features + p] * feature[p];
      }
      Vector3d sum = Vector3d::Zero();
      for (size_t j = 0; j < joints; ++j) {
        Matrix4d inverse = Matrix4d::Identity();
        inverse.topRightCorner<3, 1>() = -rest[j];
        sum += weights[v * joints + j] * (frames[j] * inverse * points[v].homogeneous()).head<3>();
      }
      points[v] = sum;
    }
    return points;
  }

  std::vector<double> vertices, shapes, pose_shapes, regressor, weights;
  std::vector<int64_t> parents;
  size_t count, joints, columns;
};

double largest_distance(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double distance = (a[i] - b[i]).norm();
    if (!(distance <= largest)) largest = distance;
  }
  return largest;
}

}  // namespace

TEST_CASE("posed vertices and joints equal the dense double-precision loops") {
  const TemporaryFolder folder;
  write_tiny_body(folder / "body.npz");
  const BodyModel body = BodyModel::load(folder / "body.npz");
  const PlainBody plain(NpzFile(folder / "body.npz"));
  REQUIRE(body.vertex_count() == 9);
  REQUIRE(body.joint_count() == 55);
  CHECK(body.face_count() == 8);
  CHECK(body.shape_count() == 10);
  CHECK(body.expression_count() == 3);
  CHECK(body.parents()[0] == -1);
  CHECK(body.parents()[54] == 53);

  const std::vector<double> betas = random_values(10, 8, -2, 2);
  const Pose pose = random_pose(55, 3, 9);
  CHECK(largest_distance(body.canonical_vertices(betas, pose.expression), plain.shaped(10, betas, pose.expression)) <
        1e-12);
  const std::vector<Vector3d> rest = plain.rest_joints(plain.shaped(10, betas, {}));
  CHECK(largest_distance(body.joints(betas), rest) < 1e-12);
  CHECK(largest_distance(body.joints({}), plain.rest_joints(plain.shaped(10, {}, {}))) < 1e-12);
  const std::vector<Vector3d> world = plain.posed(10, pose, betas);
  CHECK(largest_distance(body.posed_vertices(pose, betas, true), world) < 1e-7);  // pose shapes are single precision

  const JointFrames frames = body.posed_joints(pose, betas);
  const std::vector<Matrix4d> chain = plain.chain(pose, rest);
  for (int j = 0; j < 55; ++j) {
    CHECK((frames.rotations[j] - chain[j].topLeftCorner<3, 3>()).norm() < 1e-12);
    CHECK((frames.positions[j] - chain[j].topRightCorner<3, 1>()).norm() < 1e-12);
  }

  // The root turns about the pelvis joint, then the translation is added.
  std::vector<Vector3d> local = body.posed_vertices(pose, betas, false);
  CHECK(largest_distance(local, world) > 0.1);
  for (Vector3d& p : local) p = rodrigues(pose.axis_angles[0]) * (p - rest[0]) + rest[0] + pose.translation;
  CHECK(largest_distance(local, world) < 1e-7);
}

TEST_CASE("both layouts of the pose blend shapes and of the root's parent are read") {
  const TemporaryFolder folder;
  auto arrays = tiny_body_arrays();
  write_npz(folder / "a.npz", arrays);
  const std::vector<float> by_vertex = arrays.at("posedirs").floats();
  std::vector<float> by_feature(by_vertex.size());
  for (int p = 0; p < 486; ++p) {
    for (int i = 0; i < 27; ++i) by_feature[p * 27 + i] = by_vertex[i * 486 + p];
  }
  arrays["posedirs"] = NpyArray::from({486, 27}, by_feature);
  std::vector<int64_t> tree = arrays.at("kintree_table").integers();
  tree[0] = -1;
  arrays["kintree_table"] = NpyArray::from({2, 55}, tree);
  write_npz(folder / "b.npz", arrays);
  const Pose pose = random_pose(55, 3, 11);
  const std::vector<Vector3d> a = BodyModel::load(folder / "a.npz").posed_vertices(pose, {1}, true);
  CHECK(largest_distance(a, BodyModel::load(folder / "b.npz").posed_vertices(pose, {1}, true)) == 0);
}

TEST_CASE("the mean hand is added to the finger joints alone") {
  const TemporaryFolder folder;
  write_tiny_body(folder / "body.npz");
  const Pose pose = random_pose(55, 0, 12);
  const Pose meant = BodyModel::load(folder / "body.npz").with_hand_mean(pose);
  const NpzFile file(folder / "body.npz");
  const std::vector<double> left = file.read("hands_meanl").doubles(), right = file.read("hands_meanr").doubles();
  for (int j = 0; j < 55; ++j) {
    Vector3d mean = Vector3d::Zero();
    if (j >= 40) {
      mean = Eigen::Map<const Vector3d>(right.data() + 3 * (j - 40));
    } else if (j >= 25) {
      mean = Eigen::Map<const Vector3d>(left.data() + 3 * (j - 25));
    }
    CHECK((meant.axis_angles[j] - pose.axis_angles[j] - mean).norm() < 1e-12);
  }
  auto arrays = tiny_body_arrays();
  arrays.erase("hands_meanl");
  arrays.erase("hands_meanr");
  write_npz(folder / "handless.npz", arrays);
  CHECK_THROWS_WITH(BodyModel::load(folder / "handless.npz").with_hand_mean(pose),
                    Contains("handless.npz: no 'hands_meanl'"));
}

TEST_CASE("faults of a body model name file and key") {
  const TemporaryFolder folder;
  const auto load_with = [&](const std::string& key, std::optional<NpyArray> array) {
    auto arrays = tiny_body_arrays();
    arrays.erase(key);
    if (array) arrays[key] = *array;
    write_npz(folder / "bad.npz", arrays);
    BodyModel::load(folder / "bad.npz");
  };
  for (const std::string key :
       {"v_template", "shapedirs", "posedirs", "J_regressor", "kintree_table", "weights", "f", "vt", "ft"}) {
    CAPTURE(key);
    CHECK_THROWS_WITH(load_with(key, {}), Contains("bad.npz: no array '" + key + "'"));
    CHECK_THROWS_WITH(load_with(key, NpyArray::from({2, 2, 2, 1}, std::vector<float>(8))),
                      Contains("bad.npz: '" + key + "' has shape (2, 2, 2, 1), expected"));
  }
  CHECK_THROWS_WITH(load_with("hands_meanr", {}), Contains("bad.npz: no array 'hands_meanr'"));
  for (const std::string key : {"v_template", "shapedirs", "posedirs", "J_regressor", "weights", "vt", "hands_meanl"}) {
    CAPTURE(key);
    const NpyArray array = tiny_body_arrays().at(key);
    std::vector<double> values = array.doubles();
    values[5] = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_WITH(load_with(key, NpyArray::from(array.shape, values)),
                      Contains("bad.npz: '" + key + "' has nan at element 5"));
  }
  const auto changed = [&](const std::string& key, int index, int64_t value) {
    const NpyArray array = tiny_body_arrays().at(key);
    std::vector<int64_t> values = array.integers();
    values[index] = value;
    return NpyArray::from(array.shape, values);
  };
  CHECK_THROWS_WITH(load_with("kintree_table", changed("kintree_table", 0, 0)),
                    Contains("bad.npz: 'kintree_table' gives joint 0 the parent 0"));
  CHECK_THROWS_WITH(load_with("kintree_table", changed("kintree_table", 7, 7)),
                    Contains("'kintree_table' gives joint 7 the parent 7"));
  CHECK_THROWS_WITH(load_with("kintree_table", changed("kintree_table", 7, -1)), Contains("gives joint 7 the parent"));
  CHECK_THROWS_WITH(load_with("f", changed("f", 4, 9)), Contains("bad.npz: 'f' has index 9 in triangle 1"));
  CHECK_THROWS_WITH(load_with("ft", changed("ft", 4, -1)), Contains("bad.npz: 'ft' has index -1 in triangle 1"));
  CHECK_THROWS_WITH(load_with("weights", NpyArray::from({9, 55}, std::vector<double>(9 * 55, 0.1))),
                    Contains("bad.npz: 'weights' of vertex 0 sum to 5.5"));
  CHECK_THROWS_WITH(load_with("vt", NpyArray::from({9, 2}, std::vector<double>(18, 1.5))),
                    Contains("bad.npz: 'vt' has (1.5, 1.5) at 0"));
  CHECK_THROWS_WITH(BodyModel::load(folder / "missing.npz"), Contains("missing.npz: no such file"));
}

TEST_CASE("parameters that do not fit the body are refused") {
  const TemporaryFolder folder;
  write_tiny_body(folder / "body.npz");
  const BodyModel body = BodyModel::load(folder / "body.npz");
  std::vector<double> long_betas(300, 0.0);
  CHECK_NOTHROW(body.canonical_vertices(long_betas, {}));
  long_betas[10] = 1;
  CHECK_THROWS_WITH(body.canonical_vertices(long_betas, {}), Contains("has 10 shape columns, but coefficient 10"));
  CHECK_THROWS_WITH(body.joints(long_betas), Contains("has 10 shape columns"));
  CHECK_THROWS_WITH(body.canonical_vertices({}, {0, 0, 0, 2}), Contains("has 3 expression columns, but coefficient 3"));
  CHECK_THROWS_WITH(body.posed_vertices(random_pose(24, 0, 1), {}, true), Contains("55 joints, but the pose has 24"));
  CHECK_THROWS_AS(body.posed_joints(random_pose(24, 0, 1), {}), Error);
}

TEST_CASE("a full-size body is read, and posed like the dense loops pose it") {
  const std::string path = data_path("data/bodies/male.npz");
  if (path.empty()) return;
  const BodyModel body = BodyModel::load(path);
  const PlainBody plain{NpzFile(path)};
  CHECK(body.vertex_count() == 13838);
  CHECK(body.face_count() == 27568);
  CHECK(body.shape_count() == 300);
  CHECK(body.expression_count() == 100);
  const Pose pose = random_pose(55, 10, 13);
  CHECK(largest_distance(body.posed_vertices(pose, {}, true), plain.posed(300, pose, {})) <
        1e-6);  // its weights sum to 1 within 1e-7

  const std::vector<int> head = body.head_vertices();
  CHECK(head.size() > 2000);
  const double chin = body.joints({})[12].y();  // the neck joint lies below every vertex of the head
  const std::vector<Vector3d> rest = body.canonical_vertices({}, {});
  for (const int v : head) CHECK(rest[v].y() > chin - 0.02);
}
