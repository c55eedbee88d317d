#include "model/body/body_model.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

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

TEST_CASE("fingers are the first components times their coefficients, plus the mean hand unless that is flat") {
  const TemporaryFolder folder;
  write_tiny_body(folder / "body.npz");
  const BodyModel body = BodyModel::load(folder / "body.npz");
  const NpzFile file(folder / "body.npz");
  const size_t count = GENERATE(size_t{0}, size_t{1}, size_t{6}, size_t{12}, size_t{45});
  const bool flat_hand_mean = GENERATE(true, false);
  CAPTURE(count, flat_hand_mean);
  Pose given = random_pose(55, 3, 12);
  Pose expected = given;
  const char* sides[] = {"l", "r"};
  for (int hand = 0; hand < 2; ++hand) {
    given.hand_coefficients[hand] = random_values(static_cast<int64_t>(count), 30 + hand, -2, 2);
    const std::vector<double> mean = file.read(std::string("hands_mean") + sides[hand]).doubles();
    const std::vector<double> components = file.read(std::string("hands_components") + sides[hand]).doubles();
    for (int angle = 0; angle < 45; ++angle) {
      double sum = flat_hand_mean ? 0 : mean[angle];
      for (size_t i = 0; i < count; ++i) sum += given.hand_coefficients[hand][i] * components[45 * i + angle];
      expected.axis_angles[25 + 15 * hand + angle / 3][angle % 3] += sum;
    }
  }
  const Pose whole = body.with_hands(given, flat_hand_mean);
  CHECK(largest_distance(whole.axis_angles, expected.axis_angles) < 1e-12);
  for (int j = 0; j < 25; ++j) CHECK(whole.axis_angles[j] == given.axis_angles[j]);
  CHECK((whole.hand_coefficients[0].empty() && whole.hand_coefficients[1].empty()));
  CHECK(whole.translation == given.translation);
  CHECK(whole.expression == given.expression);
  CHECK(largest_distance(body.posed_vertices(whole, {}, true), PlainBody(file).posed(10, expected, {})) < 1e-7);
}

TEST_CASE("hands that a body model lacks are asked for by its keys") {
  const TemporaryFolder folder;
  auto arrays = tiny_body_arrays();
  for (const char* key : {"hands_meanl", "hands_meanr", "hands_componentsl", "hands_componentsr"}) arrays.erase(key);
  write_npz(folder / "handless.npz", arrays);
  const BodyModel handless = BodyModel::load(folder / "handless.npz");
  Pose pose = random_pose(55, 0, 12);
  CHECK(handless.with_hands(pose, true).axis_angles == pose.axis_angles);
  CHECK_THROWS_WITH(handless.with_hands(pose, false), Contains("handless.npz: no 'hands_meanl'"));
  pose.hand_coefficients = {{{1, 2, 3, 4, 5, 6}, {1, 2, 3, 4, 5, 6}}};
  CHECK_THROWS_WITH(handless.with_hands(pose, true),
                    Contains("handless.npz: 'hands_componentsl' is missing, but the capture's fingers are 6 "
                             "coefficients") &&
                        Contains("take the body model that it was fitted with"));
  arrays["hands_componentsl"] = tiny_body_arrays()["hands_componentsl"];
  arrays["hands_componentsr"] = NpyArray::from({5, 45}, std::vector<float>(5 * 45));
  write_npz(folder / "five.npz", arrays);
  CHECK_THROWS_WITH(BodyModel::load(folder / "five.npz").with_hands(pose, true),
                    Contains("five.npz: 'hands_componentsr' has 5 rows, but"));
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
