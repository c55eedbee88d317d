#include "host/ops/skinning.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/autograd/gradient_check.h"
#include "host/ops/camera.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

using std::numbers::pi;

struct SkinnedPoints {
  int count, influences, joints;
  std::vector<double> positions, rotations, weights, matrices, joint_rotations;
  std::vector<int32_t> influence_joints;

  /// Random points and joints; some influences of weight zero at the end, as the atlas writes them.
  SkinnedPoints(int count, int influences, int joints) : count(count), influences(influences), joints(joints) {
    positions = random_values(count * 3, 1);
    rotations = random_values(count * 4, 2);
    matrices = random_values(joints * 12, 3);
    for (int j = 0; j < joints; ++j) {
      const std::vector<double> q = random_values(4, 100 + j);
      const double norm = std::sqrt(std::inner_product(q.begin(), q.end(), q.begin(), 0.0));
      for (double value : q) joint_rotations.push_back(value / norm);
    }
    for (int i = 0; i < count; ++i) {
      std::vector<double> own = random_values(influences, 1000 + i, 0.05, 1);
      for (int k = influences - i % influences; k < influences; ++k) own[k] = 0;
      std::sort(own.rbegin(), own.rend());
      const double total = std::accumulate(own.begin(), own.end(), 0.0);
      for (int k = 0; k < influences; ++k) {
        weights.push_back(own[k] / total);
        influence_joints.push_back((i * 7 + k * 3) % joints);
      }
    }
  }

  SkinningWeights skinning(Device& device) const {
    return {Tensor::from(device, {count, influences}, std::span<const int32_t>(influence_joints)),
            Tensor::from(device, {count, influences}, std::span<const double>(weights))};
  }
  JointTransforms transforms(Device& device) const {
    return {Tensor::from(device, {joints, 3, 4}, std::span<const double>(matrices)),
            Tensor::from(device, {joints, 4}, std::span<const double>(joint_rotations))};
  }
  Tensor position_tensor(Device& device) const {
    return Tensor::from(device, {count, 3}, std::span<const double>(positions));
  }
  Tensor rotation_tensor(Device& device) const {
    return Tensor::from(device, {count, 4}, std::span<const double>(rotations));
  }
};

Eigen::Quaterniond quaternion_at(const std::vector<double>& values, int index) {
  const double* q = &values[index * 4];
  return {q[0], q[1], q[2], q[3]};
}

std::vector<double> expected_positions(const SkinnedPoints& scene) {
  std::vector<double> result;
  for (int i = 0; i < scene.count; ++i) {
    Eigen::Vector3d total = Eigen::Vector3d::Zero();
    const Eigen::Map<const Eigen::Vector3d> p(&scene.positions[i * 3]);
    for (int k = 0; k < scene.influences; ++k) {
      const int at = i * scene.influences + k;
      const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> m(
          &scene.matrices[scene.influence_joints[at] * 12]);
      total += scene.weights[at] * (m * p.homogeneous());
    }
    result.insert(result.end(), total.data(), total.data() + 3);
  }
  return result;
}

std::vector<double> expected_rotations(const SkinnedPoints& scene) {
  std::vector<double> result;
  for (int i = 0; i < scene.count; ++i) {
    Eigen::Vector4d blend = Eigen::Vector4d::Zero();
    const Eigen::Quaterniond reference =
        quaternion_at(scene.joint_rotations, scene.influence_joints[i * scene.influences]);
    for (int k = 0; k < scene.influences; ++k) {
      const int at = i * scene.influences + k;
      const Eigen::Quaterniond q = quaternion_at(scene.joint_rotations, scene.influence_joints[at]);
      blend += (q.dot(reference) < 0 ? -1 : 1) * scene.weights[at] * q.coeffs();
    }
    const Eigen::Quaterniond turned = Eigen::Quaterniond(blend.normalized()) * quaternion_at(scene.rotations, i);
    for (double value : {turned.w(), turned.x(), turned.y(), turned.z()}) result.push_back(value);
  }
  return result;
}

}  // namespace

TEST_CASE("skinning equals the plain loops") {
  const auto set = GENERATE(from_range(kernel_sets()));
  const int count = GENERATE(1, 63, 64, 65, 1031);
  const int influences = GENERATE(1, 4, 8);
  Device& device = test::device(set);
  Tape tape(device, false);
  const SkinnedPoints scene(count, influences, 55);
  CHECK(largest_difference(
            skin_positions(tape, scene.position_tensor(device), scene.skinning(device), scene.transforms(device))
                .to_host<double>(),
            expected_positions(scene)) < 2e-6);
  CHECK(largest_difference(
            skin_rotations(tape, scene.rotation_tensor(device), scene.skinning(device), scene.transforms(device))
                .to_host<double>(),
            expected_rotations(scene)) < 5e-6);
}

TEST_CASE("skinning gradients pass finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  // More than one block of Gaussians in both kernel sets, the last one partial; fewer joints and more than a
  // work-group.
  const int joints = GENERATE(5, 70);
  const SkinnedPoints scene(600, 4, joints);
  const SkinningWeights skinning = scene.skinning(device);
  JointTransforms transforms = scene.transforms(device);
  transforms.matrices.set_requires_gradient();
  transforms.rotations.set_requires_gradient();
  const Tensor positions = scene.position_tensor(device).set_requires_gradient();
  const Tensor rotations = scene.rotation_tensor(device).set_requires_gradient();
  const auto move = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{skin_positions(tape, in[0], skinning, {in[1], transforms.rotations})};
  };
  CHECK(gradient_check(device, move, {positions, transforms.matrices}) < 1e-6);
  const auto turn = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{skin_rotations(tape, in[0], skinning, {transforms.matrices, in[1]})};
  };
  CHECK(gradient_check(device, turn, {rotations, transforms.rotations}) < 1e-6);
}

TEST_CASE("the gradient of refined poses goes through skinning and kinematics") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const SkinnedPoints scene(40, 3, 5);
  const std::vector<int32_t> parents = {-1, 0, 1, 1, 3};
  const Tensor rest = random_tensor(device, {5, 3}, 21),
               tree = Tensor::from(device, {5}, std::span<const int32_t>(parents));
  const Tensor angles = random_tensor(device, {5, 3}, 22).set_requires_gradient();
  const Tensor translation = random_tensor(device, {3}, 23).set_requires_gradient();
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    const JointTransforms transforms = kinematics(tape, in[0], in[1], rest, tree);
    return std::vector{skin_positions(tape, scene.position_tensor(device), scene.skinning(device), transforms),
                       skin_rotations(tape, scene.rotation_tensor(device), scene.skinning(device), transforms)};
  };
  CHECK(gradient_check(device, function, {angles, translation}) < 1e-6);
}

TEST_CASE("joint gradients have the same bits in every run", "[large]") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const SkinnedPoints scene(5000, 8, 55);
  const auto gradients = [&] {
    JointTransforms transforms = scene.transforms(device);
    transforms.matrices.set_requires_gradient();
    transforms.rotations.set_requires_gradient();
    Tape tape(device);
    const Tensor moved = skin_positions(tape, scene.position_tensor(device), scene.skinning(device), transforms);
    const Tensor turned = skin_rotations(tape, scene.rotation_tensor(device), scene.skinning(device), transforms);
    tape.backward(add(tape, sum(tape, multiply(tape, moved, random_tensor(device, {5000, 3}, 31))),
                      sum(tape, multiply(tape, turned, random_tensor(device, {5000, 4}, 32)))));
    std::vector<double> all = transforms.matrices.gradient().to_host<double>();
    const std::vector<double> more = transforms.rotations.gradient().to_host<double>();
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  CHECK(gradients() == gradients());
}

TEST_CASE("a twist of 180 degrees shared by halves stays a rotation") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), GENERATE(Real::Float, Real::Double));
  const double twist = GENERATE(0.0, 1.0, pi - 1e-6, pi, pi + 1e-6, 2 * pi);
  // Two joints on the x axis, the second twisted about it; a Gaussian between them.
  const std::vector<int32_t> parents = {-1, 0}, joints = {0, 1};
  const std::vector<double> angles = {0, 0, 0, twist, 0, 0}, rest = {0, 0, 0, 1, 0, 0}, halves = {0.5, 0.5};
  const std::vector<double> start = {0.9, 0.1, -0.2, 0.3};
  const Tensor input = Tensor::from(device, {1, 4}, std::span<const double>(start)).set_requires_gradient();
  const Tensor pose = Tensor::from(device, {2, 3}, std::span<const double>(angles)).set_requires_gradient();
  const auto turn = [&](Tape& tape, const std::vector<Tensor>& in) {
    const JointTransforms transforms =
        kinematics(tape, in[1], Tensor::zeros(device, {3}), Tensor::from(device, {2, 3}, std::span<const double>(rest)),
                   Tensor::from(device, {2}, std::span<const int32_t>(parents)));
    return std::vector{skin_rotations(tape, in[0],
                                      {Tensor::from(device, {1, 2}, std::span<const int32_t>(joints)),
                                       Tensor::from(device, {1, 2}, std::span<const double>(halves))},
                                      transforms)};
  };
  Tape tape(device, false);
  const Eigen::Quaterniond turned = quaternion_at(turn(tape, {input, pose})[0].to_host<double>(), 0);
  const Eigen::Quaterniond original = quaternion_at(start, 0);
  CHECK(turned.norm() == Approx(original.norm()).epsilon(1e-6));
  // Beyond 180 degrees the shorter way round is the other one; exactly there either is right.
  const double half = std::remainder(twist, 2 * pi) / 2;
  const Eigen::Quaterniond one = Eigen::AngleAxisd(half, Eigen::Vector3d::UnitX()) * original;
  const Eigen::Quaterniond other = Eigen::AngleAxisd(-half, Eigen::Vector3d::UnitX()) * original;
  const double error = 1 - std::abs(turned.dot(one)) / original.squaredNorm();
  const double error_other = 1 - std::abs(turned.dot(other)) / original.squaredNorm();
  CHECK(std::min(error, std::abs(twist - pi) < 1e-5 ? error_other : error) < 1e-6);
  // Near 180 degrees the two sides meet within the step of the difference.
  if (device.real_bytes() == 8 && std::abs(twist - pi) > 1e-3)
    CHECK(gradient_check(device, turn, {input, pose}) < 1e-6);
}

TEST_CASE("turning the root turns what a camera sees as turning the camera does") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const SkinnedPoints scene(50, 4, 6);
  const std::vector<int32_t> parents = {-1, 0, 1, 1, 3, 0};
  const std::vector<double> rest = random_values(18, 41);
  const Eigen::Vector3d pelvis(rest[0], rest[1], rest[2]), shift(0.2, 0.1, -0.3);
  const Eigen::AngleAxisd turn(1.2, Eigen::Vector3d(0.3, -0.8, 0.5).normalized());
  Camera camera;
  camera.fx = 500, camera.fy = 520, camera.cx = 300, camera.cy = 210;
  camera.translation = {0, 0, 8};
  // x_world' = turn (x_world - pelvis) + pelvis + shift, so the turned person before the turned camera is the same
  // view.
  Camera turned_camera = camera;
  turned_camera.rotation = camera.rotation * turn.matrix().transpose();
  turned_camera.translation = camera.translation + camera.rotation * pelvis - turned_camera.rotation * (pelvis + shift);

  const auto seen = [&](bool turned, const Camera& by) {
    std::vector<double> angles = random_values(18, 42);
    Eigen::Map<Eigen::Vector3d>(angles.data()) =
        turned ? Eigen::Vector3d(turn.angle() * turn.axis()) : Eigen::Vector3d::Zero();
    const Eigen::Vector3d moved = turned ? shift : Eigen::Vector3d::Zero();
    Tape tape(device, false);
    const JointTransforms transforms = kinematics(tape, Tensor::from(device, {6, 3}, std::span<const double>(angles)),
                                                  Tensor::from(device, {3}, std::span<const double>(moved.data(), 3)),
                                                  Tensor::from(device, {6, 3}, std::span<const double>(rest)),
                                                  Tensor::from(device, {6}, std::span<const int32_t>(parents)));
    const auto p =
        skin_positions(tape, scene.position_tensor(device), scene.skinning(device), transforms).to_host<double>();
    const auto q =
        skin_rotations(tape, scene.rotation_tensor(device), scene.skinning(device), transforms).to_host<double>();
    std::vector<double> view;
    for (int i = 0; i < scene.count; ++i) {
      const Eigen::Vector3d pixel = by.project(Eigen::Vector3d(p[i * 3], p[i * 3 + 1], p[i * 3 + 2]));
      view.insert(view.end(), pixel.data(), pixel.data() + 3);
      const Eigen::Matrix3d axes = by.rotation * quaternion_at(q, i).normalized().matrix();
      view.insert(view.end(), axes.data(), axes.data() + 9);
    }
    return view;
  };
  CHECK(largest_difference(seen(true, turned_camera), seen(false, camera)) < 2e-5);
}
