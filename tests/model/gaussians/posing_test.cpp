#include "model/gaussians/posing.h"

#include <Eigen/Geometry>
#include <cmath>

#include "host/autograd/gradient_check.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/test_devices.h"
#include "tests/support/tiny_subject.h"

using namespace degas;
using namespace degas::test;

namespace {

Pose random_pose(const BodyModel& body, unsigned seed) {
  const std::vector<double> angles = random_values(body.joint_count() * 3, seed, -0.5, 0.5);
  Pose pose;
  for (int j = 0; j < body.joint_count(); ++j) pose.axis_angles.emplace_back(&angles[j * 3]);
  pose.translation = {0.3, -0.4, 2};
  return pose;
}

Eigen::Matrix3d axes(const std::vector<double>& rotations, int index) {
  const double* q = &rotations[index * 4];
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

}  // namespace

TEST_CASE("unchanged Gaussians follow the skinned surface of the body") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const TinySubject subject;
  const Pose pose = random_pose(subject.body, 7);
  Tape tape(device, false);
  const Splats splats = subject.posed(tape, subject.heads(device, 0), make_device_pose(device, pose));

  // Skinned as points of their own, by the joints as the body model on the host poses them.
  const JointFrames frames = subject.body.posed_joints(pose, subject.betas);
  const std::vector<Eigen::Vector3d> rest = subject.body.joints(subject.betas);
  const BaseMaps& maps = subject.maps;
  std::vector<double> expected;
  for (size_t i = 0; i < maps.covered.size(); ++i) {
    const Eigen::Vector3d point = Eigen::Map<const Eigen::Vector3f>(&maps.positions[i * 3]).cast<double>();
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    for (int k = 0; k < maps.influences; ++k) {
      const int joint = maps.joints[i * maps.influences + k];
      moved += maps.weights[i * maps.influences + k] *
               (frames.rotations[joint] * (point - rest[joint]) + frames.positions[joint]);
    }
    expected.insert(expected.end(), moved.data(), moved.data() + 3);
  }
  CHECK(largest_difference(splats.positions.to_host<double>(), expected) < 5e-6);
  for (double opacity : splats.opacities.to_host<double>()) CHECK(opacity == Approx(0.5));
  for (double color : splats.colors.to_host<double>()) CHECK(color == Approx(0.5));
}

TEST_CASE("a rigid motion of the root moves positions and rotations as one body") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const TinySubject subject;
  Pose pose = random_pose(subject.body, 8);
  pose.axis_angles[0].setZero();
  pose.translation.setZero();
  Pose turned = pose;
  const Eigen::AngleAxisd turn(2.1, Eigen::Vector3d(1, -2, 0.5).normalized());
  turned.axis_angles[0] = turn.angle() * turn.axis();
  turned.translation = {1, 2, -0.5};
  Tape tape(device, false);
  const AssemblyMaps heads = subject.heads(device, 0.5);
  const Splats before = subject.posed(tape, heads, make_device_pose(device, pose));
  const Splats after = subject.posed(tape, heads, make_device_pose(device, turned));
  const auto p = before.positions.to_host<double>(), moved = after.positions.to_host<double>();
  const auto q = before.rotations.to_host<double>(), rotated = after.rotations.to_host<double>();
  const Eigen::Vector3d pelvis = subject.body.joints(subject.betas)[0];
  for (size_t i = 0; i < subject.maps.covered.size(); ++i) {
    const Eigen::Vector3d from(&p[i * 3]), to(&moved[i * 3]);
    CHECK((turn * (from - pelvis) + pelvis + turned.translation - to).norm() < 1e-5);
    CHECK((turn.matrix() * axes(q, i) - axes(rotated, i)).norm() < 1e-5);
  }
}

TEST_CASE("the gradient of posed Gaussians reaches the maps and the pose") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const TinySubject subject;
  AssemblyMaps heads = subject.heads(device, 0.5);
  DevicePose pose = make_device_pose(device, random_pose(subject.body, 9));
  for (Tensor* tensor :
       {&heads.positions, &heads.rotations_scales, &heads.colors_opacities, &pose.axis_angles, &pose.translation}) {
    tensor->set_requires_gradient();
  }
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    const Splats s = subject.posed(tape, {in[0], in[1], in[2], {}}, {in[3], in[4]});
    return std::vector{s.positions, s.rotations, s.log_scales, s.opacities, s.colors};
  };
  CHECK(gradient_check(device, function,
                       {heads.positions, heads.rotations_scales, heads.colors_opacities, pose.axis_angles,
                        pose.translation}) < 1e-6);
}

TEST_CASE("turning the root and the camera alike leaves the image as it was") {
  // In double, as a splat at the border of 1/255 may otherwise come or go.
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const TinySubject subject;
  Pose pose = random_pose(subject.body, 10);
  pose.axis_angles[0].setZero();
  pose.translation.setZero();
  Pose turned = pose;
  const Eigen::AngleAxisd turn(2.1, Eigen::Vector3d(1, -2, 0.5).normalized());
  turned.axis_angles[0] = turn.angle() * turn.axis();
  turned.translation = {1, 2, -0.5};
  const AssemblyMaps heads = subject.heads(device, 0.5);
  const auto draw = [&](const Pose& of, const Camera& camera) {
    Tape tape(device, false);
    SplatWorkspace workspace;
    const Splats splats = subject.posed(tape, heads, make_device_pose(device, of));
    return splat(tape, workspace, splats, camera, {0.1, 0.2, 0.3}).color.to_host<double>();
  };
  Tape tape(device, false);
  const auto points = subject.posed(tape, heads, make_device_pose(device, pose)).positions.to_host<double>();
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>> rows(points.data(),
                                                                                         points.size() / 3, 3);
  const Eigen::Vector3d middle = rows.colwise().mean();
  const double extent = (rows.rowwise() - middle.transpose()).rowwise().norm().maxCoeff();
  Camera camera;
  camera.width = 53, camera.height = 41;
  camera.fx = camera.fy = 60, camera.cx = 25, camera.cy = 22;
  camera.translation = Eigen::Vector3d(0, 0, 3 * extent) - middle;
  const Eigen::Vector3d pelvis = subject.body.joints(subject.betas)[0];
  Camera turned_camera = camera;
  turned_camera.rotation = camera.rotation * turn.matrix().transpose();
  turned_camera.translation =
      camera.translation + camera.rotation * pelvis - turned_camera.rotation * (pelvis + turned.translation);

  const std::vector<double> image = draw(pose, camera);
  CHECK(largest_difference(draw(turned, turned_camera), image) < 1e-6);
  // The person is in the picture, and turning the person alone shows.
  CHECK(largest_difference(draw(turned, camera), image) > 0.05);
}
