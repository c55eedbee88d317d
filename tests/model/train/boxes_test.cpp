#include "model/train/boxes.h"

#include <cmath>

#include "tests/support/catch.h"
#include "tests/support/test_devices.h"
#include "tests/support/training_scene.h"

using namespace degas;
using namespace degas::test;

namespace {

const BodyModel& body() {
  static const BodyModel loaded = BodyModel::load(training_scene() / "body.npz");
  return loaded;
}

Pose rest_pose() {
  return {std::vector<Eigen::Vector3d>(static_cast<size_t>(body().joint_count()), Eigen::Vector3d::Zero()),
          Eigen::Vector3d::Zero(),
          {}};
}

/// Two metres before the head, looking at it along -z of the world; the head is some 100 pixels high.
Camera facing_camera(const Pose& pose) {
  Camera camera;
  camera.width = 400;
  camera.height = 300;
  camera.fx = camera.fy = 800;
  camera.cx = 200;
  camera.cy = 150;
  camera.rotation << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  const Eigen::Vector3d head = body().posed_joints(pose, {}).positions[HeadJoint];
  camera.translation = -camera.rotation * (head + Eigen::Vector3d(0, 0, 2));
  return camera;
}

}  // namespace

TEST_CASE("the head's box is the tightest around its vertices") {
  Pose pose = rest_pose();
  pose.axis_angles[0] = {0, 0.3, 0};
  pose.axis_angles[HeadJoint] = {0.2, 0.1, 0};
  pose.translation = {0.1, 0.5, -0.2};
  const Camera camera = facing_camera(pose);
  const auto box = head_box(body(), pose, {}, camera);
  REQUIRE(box);
  const std::vector<Eigen::Vector3d> vertices = body().posed_vertices(pose, {}, true);
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  REQUIRE(body().head_vertices().size() > 100);
  for (int vertex : body().head_vertices()) {
    const Eigen::Vector3d pixel = camera.project(vertices[static_cast<size_t>(vertex)]);
    left = std::min(left, pixel.x());
    right = std::max(right, pixel.x());
    top = std::min(top, pixel.y());
    bottom = std::max(bottom, pixel.y());
  }
  CHECK(box->left == std::floor(left));
  CHECK(box->top == std::floor(top));
  CHECK(box->left + box->width == std::ceil(right));
  CHECK(box->top + box->height == std::ceil(bottom));
  // And it is a head's: 15 to 40 cm on each side.
  CHECK((box->width > 60 && box->width < 160));
  CHECK((box->height > 60 && box->height < 160));
}

TEST_CASE("the mouth's box holds what the jaw moves, moves with it, and lies within the face's") {
  Pose pose = rest_pose();
  const Camera camera = facing_camera(pose);
  const Rectangle face = face_box(body(), pose, {}, camera).value();
  const Rectangle closed = mouth_box(body(), pose, {}, camera).value();
  const std::vector<Eigen::Vector3d> vertices = body().posed_vertices(pose, {}, true);
  REQUIRE(body().jaw_vertices().size() > 10);
  for (const int vertex : body().jaw_vertices()) {
    const Eigen::Vector3d pixel = camera.project(vertices[static_cast<size_t>(vertex)]);
    CHECK((pixel.x() > closed.left && pixel.x() < closed.left + closed.width));
    CHECK((pixel.y() > closed.top && pixel.y() < closed.top + closed.height));
  }
  CHECK((closed.left >= face.left && closed.left + closed.width <= face.left + face.width));
  CHECK(closed.top > face.top + face.height / 3);
  CHECK(closed.height < face.height / 2);
  pose.axis_angles[JawJoint] = {0.35, 0, 0};
  const Rectangle open = mouth_box(body(), pose, {}, camera).value();
  CHECK(open.top + open.height > closed.top + closed.height);
}

TEST_CASE("the head's box is cut to the picture; a head out of sight has none") {
  const Pose pose = rest_pose();
  const Camera camera = facing_camera(pose);
  const Rectangle whole = head_box(body(), pose, {}, camera).value();
  const int cut = whole.left + whole.width / 2;
  const Rectangle right = head_box(body(), pose, {}, camera.cropped(cut, 0, 400 - cut, 300)).value();
  CHECK(right.left == 0);
  CHECK(right.width == whole.left + whole.width - cut);
  CHECK(right.top == whole.top);
  const Rectangle left = head_box(body(), pose, {}, camera.cropped(0, 0, cut, 300)).value();
  CHECK(left.left + left.width == cut);
  CHECK_FALSE(head_box(body(), pose, {}, camera.cropped(whole.left + whole.width, 0, 50, 300)));
  CHECK_FALSE(head_box(body(), pose, {}, camera.cropped(0, 0, 400, whole.top)));

  Camera from_behind = camera;  // the same place, turned about: the head lies behind the camera
  from_behind.rotation = Eigen::Vector3d(-1, 1, -1).asDiagonal() * camera.rotation;
  from_behind.translation = Eigen::Vector3d(-1, 1, -1).asDiagonal() * camera.translation;
  CHECK_FALSE(head_box(body(), pose, {}, from_behind));

  Pose broken = pose;
  broken.translation.x() = NAN;
  CHECK_FALSE(head_box(body(), broken, {}, camera));
}
