#include "model/drive/driving_signal.h"

#include <Eigen/Geometry>

#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"
#include "tests/support/tiny_body.h"

using namespace degas;
using namespace degas::test;
using Eigen::Vector3d;

namespace {

Pose random_pose(const BodyModel& body) {
  const std::vector<double> values = random_values(3 * body.joint_count() + 3, 7, -0.5, 0.5);
  Pose pose;
  for (int j = 0; j < body.joint_count(); ++j) {
    pose.axis_angles.emplace_back(values[3 * j], values[3 * j + 1], values[3 * j + 2]);
  }
  pose.translation = Eigen::Map<const Vector3d>(values.data() + 3 * body.joint_count());
  pose.expression = random_values(body.expression_count(), 8, -1, 1);
  return pose;
}

}  // namespace

TEST_CASE("the face code alone moves the face, and the global motion only turns the normals") {
  const TemporaryFolder folder;
  write_tiny_body(folder.path() / "body.npz");
  const BodyModel body = BodyModel::load(folder.path() / "body.npz");
  const UvAtlas atlas(body, 32);
  const Pose pose = random_pose(body);
  const auto signal_of = [&](const Pose& registered) {
    return make_driving_signal(body, atlas, driven_pose(registered, FaceSignal::Code), {}, {1, 2, 3}, {true, false});
  };
  const DrivingSignal signal = signal_of(pose);
  CHECK(signal.face_code == std::vector<float>{1, 2, 3});

  Pose other_face = pose;
  other_face.axis_angles[JawJoint] += Vector3d(0.3, 0, 0);
  other_face.expression[0] += 1;
  const DrivingSignal same = signal_of(other_face);
  CHECK(same.posed_vertex_map == signal.posed_vertex_map);
  CHECK(same.joint_angles == signal.joint_angles);
  CHECK(same.world_normals == signal.world_normals);

  Pose turned = pose;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.8, Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  const Eigen::AngleAxisd global(turn * rotation_from_axis_angle(pose.axis_angles[0]));
  turned.axis_angles[0] = global.angle() * global.axis();
  turned.translation += Vector3d(1, 2, 3);
  const DrivingSignal moved = signal_of(turned);
  CHECK(moved.posed_vertex_map == signal.posed_vertex_map);
  CHECK(moved.joint_angles == signal.joint_angles);
  for (const int texel : atlas.covered()) {
    const Eigen::Map<const Eigen::Vector3f> before(&signal.world_normals[3 * texel]);
    const Eigen::Map<const Eigen::Vector3f> after(&moved.world_normals[3 * texel]);
    CHECK((after.cast<double>() - turn * before.cast<double>()).norm() < 1e-5);
  }
}

TEST_CASE("an expression signal holds the coefficients and the jaw, which moves the body's jaw joint too") {
  const TemporaryFolder folder;
  write_tiny_body(folder.path() / "body.npz");
  const BodyModel body = BodyModel::load(folder.path() / "body.npz");
  const Pose pose = random_pose(body);
  const Pose driven = driven_pose(pose, FaceSignal::Expression);
  CHECK(driven.axis_angles == pose.axis_angles);
  CHECK(driven.expression == std::vector<double>(pose.expression.size(), 0));
  CHECK(driven_pose(pose, FaceSignal::Code).axis_angles[JawJoint] == Vector3d::Zero());
  const std::vector<float> code = expression_code(pose);
  REQUIRE(code.size() == pose.expression.size() + 3);
  for (size_t i = 0; i < pose.expression.size(); ++i) CHECK(code[i] == static_cast<float>(pose.expression[i]));
  for (int c = 0; c < 3; ++c) {
    CHECK(code[pose.expression.size() + c] == static_cast<float>(pose.axis_angles[JawJoint][c]));
  }
}

TEST_CASE("a mesh signal moves the body by the jaw and the expression, at rest by the expression alone") {
  const TemporaryFolder folder;
  write_tiny_body(folder.path() / "body.npz");
  const BodyModel body = BodyModel::load(folder.path() / "body.npz");
  const UvAtlas atlas(body, 32);
  const Pose pose = driven_pose(random_pose(body), FaceSignal::Mesh);
  CHECK(pose.axis_angles == random_pose(body).axis_angles);
  CHECK(pose.expression == random_pose(body).expression);
  const DrivingSignal signal = make_driving_signal(body, atlas, pose, {}, {}, {false, true});
  CHECK(make_driving_signal(body, atlas, pose, {}, {}, {}).canonical_positions.empty());
  REQUIRE(signal.canonical_positions.size() == 3 * atlas.covered().size());
  const std::vector<Vector3d> vertices = body.canonical_vertices({}, pose.expression);
  double moved = 0;
  for (size_t i = 0; i < atlas.covered().size(); ++i) {
    const Texel& texel = atlas.texels()[atlas.covered()[i]];
    Vector3d expected = Vector3d::Zero(), neutral = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const int vertex = body.faces()[texel.triangle][k];
      expected += texel.barycentric[k] * vertices[vertex];
      neutral += texel.barycentric[k] * body.canonical_vertices({}, {})[vertex];
    }
    for (int c = 0; c < 3; ++c) CHECK(signal.canonical_positions[3 * i + c] == Approx(expected[c]).margin(1e-6));
    moved = std::max(moved, (expected - neutral).norm());
  }
  CHECK(moved > 1e-4);
  Pose without_expression = pose;
  without_expression.expression.assign(pose.expression.size(), 0);
  CHECK(make_driving_signal(body, atlas, without_expression, {}, {}, {}).posed_vertex_map != signal.posed_vertex_map);
}

TEST_CASE("world normals are those of the surface that linear blend skinning puts into the world") {
  const TemporaryFolder folder;
  write_tiny_body(folder.path() / "body.npz");
  const BodyModel body = BodyModel::load(folder.path() / "body.npz");
  const UvAtlas atlas(body, 32);
  const Pose pose = driven_pose(random_pose(body), FaceSignal::Code);
  const std::vector<Vector3d> vertices = body.posed_vertices(pose, {}, true);
  const DrivingSignal signal = make_driving_signal(body, atlas, pose, {}, {}, {true, false});
  CHECK(make_driving_signal(body, atlas, pose, {}, {}, {}).world_normals.empty());
  // Plain loop: the sum of the triangles' area vectors around each corner.
  for (const int index : atlas.covered()) {
    const Texel& texel = atlas.texels()[index];
    Vector3d expected = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const int vertex = body.faces()[texel.triangle][k];
      Vector3d sum = Vector3d::Zero();
      for (const auto& [a, b, c] : body.faces()) {
        if (a != vertex && b != vertex && c != vertex) continue;
        sum += (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
      }
      expected += texel.barycentric[k] * sum.normalized();
    }
    for (int c = 0; c < 3; ++c) CHECK(signal.world_normals[3 * index + c] == Approx(expected[c]).margin(1e-5));
  }
}
