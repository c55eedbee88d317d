#include "model/train/turntable.h"

#include <Eigen/Dense>

#include "tests/support/catch.h"
#include "tests/support/test_devices.h"
#include "tests/support/training_scene.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("a turntable circles the person once, upright and centred") {
  const auto capture = open_scene();
  const Avatar avatar(device(KernelSet::Wide), tiny_config(), BodyModel::load(training_scene() / "body.npz"),
                      capture->betas(), capture->face_code_size());
  const std::vector<int> frames = {0, 1, 2, 5};
  const std::vector<Camera> cameras = turntable(avatar, *capture, frames);
  REQUIRE(cameras.size() == 4);

  Eigen::Vector3d center = Eigen::Vector3d::Zero(), up = Eigen::Vector3d::Zero();
  for (int frame : frames) {
    const JointFrames joints = avatar.body().posed_joints(capture->pose(frame), avatar.betas());
    center += joints.positions[PelvisJoint] / 4;
    up += joints.rotations[PelvisJoint] * Eigen::Vector3d::UnitY();
  }
  up.normalize();
  const Camera first = capture->camera(0);
  const double distance = (first.center() - center).norm();
  for (size_t i = 0; i < cameras.size(); ++i) {
    const Camera& camera = cameras[i];
    CHECK(camera.width == first.width);
    CHECK(camera.fx == first.fx);
    CHECK((camera.rotation * camera.rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-12);
    CHECK(camera.rotation.determinant() == Approx(1));
    CHECK((camera.center() - center).norm() == Approx(distance));
    CHECK(std::abs((camera.center() - center).dot(up)) < 1e-9);
    const Eigen::Vector3d pixel = camera.project(center), above = camera.project(center + 0.1 * up);
    CHECK(pixel.x() == Approx(camera.width / 2.0));
    CHECK(pixel.y() == Approx(camera.height / 2.0));
    CHECK(above.y() < pixel.y());
    CHECK(above.x() == Approx(pixel.x()));
    const Eigen::Vector3d arm = camera.center() - center, next = cameras[(i + 1) % 4].center() - center;
    CHECK(std::abs(arm.dot(next)) < 1e-9);                          // a quarter turn each
    CHECK(arm.cross(next).dot(up) == Approx(distance * distance));  // always the same way round
  }
  // It starts on the capture's first camera's side.
  Eigen::Vector3d side = first.center() - center;
  side -= up * up.dot(side);
  CHECK((cameras[0].center() - center).normalized().dot(side.normalized()) == Approx(1));
}
