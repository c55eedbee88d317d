#include "host/ops/kinematics.h"

#include <Eigen/Geometry>
#include <cmath>

#include "host/autograd/gradient_check.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

using std::numbers::pi;

/// A tree with branches, long chains and a joint whose number is far from its parent's.
struct Tree {
  explicit Tree(int joints) : parents(joints), rest(random_values(joints * 3, 5)) {
    for (int j = 0; j < joints; ++j) parents[j] = j == 0 ? -1 : j % 4 == 3 ? j / 4 : j - 1;
  }
  std::vector<int32_t> parents;
  std::vector<double> rest;
};

Eigen::Vector3d row(const std::vector<double>& values, int index) {
  return Eigen::Map<const Eigen::Vector3d>(&values[index * 3]);
}

/// posed * inverse(canonical) of every joint as (J,3,4), by 4x4 products.
std::vector<double> expected_matrices(const Tree& tree, const std::vector<double>& angles,
                                      const Eigen::Vector3d& translation) {
  std::vector<Eigen::Affine3d> posed(tree.parents.size());
  std::vector<double> result;
  for (size_t j = 0; j < posed.size(); ++j) {
    const Eigen::Vector3d a = row(angles, j);
    const Eigen::Matrix3d rotation =
        a.norm() > 0 ? Eigen::AngleAxisd(a.norm(), a.normalized()).matrix() : Eigen::Matrix3d::Identity();
    const int parent = tree.parents[j];
    const Eigen::Affine3d turn(rotation);
    if (parent < 0) {
      posed[j] = Eigen::Translation3d(row(tree.rest, j) + translation) * turn;
    } else {
      posed[j] = posed[parent] * Eigen::Translation3d(row(tree.rest, j) - row(tree.rest, parent)) * turn;
    }
    const Eigen::Affine3d relative = posed[j] * Eigen::Translation3d(-row(tree.rest, j));
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) result.push_back(relative.matrix()(r, c));
  }
  return result;
}

std::vector<double> matrices_of(const std::vector<double>& quaternions) {
  std::vector<double> result;
  for (size_t i = 0; i < quaternions.size(); i += 4) {
    const Eigen::Matrix3d m =
        Eigen::Quaterniond(quaternions[i], quaternions[i + 1], quaternions[i + 2], quaternions[i + 3])
            .toRotationMatrix();
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) result.push_back(m(r, c));
  }
  return result;
}

std::vector<double> linear_part(const std::vector<double>& matrices) {
  std::vector<double> result;
  for (size_t i = 0; i < matrices.size(); ++i)
    if (i % 4 != 3) result.push_back(matrices[i]);
  return result;
}

JointTransforms run(Tape& tape, const Tree& tree, const Tensor& angles, const Tensor& translation) {
  Device& device = tape.device();
  const int64_t joints = tree.parents.size();
  return kinematics(tape, angles, translation, Tensor::from(device, {joints, 3}, std::span<const double>(tree.rest)),
                    Tensor::from(device, {joints}, std::span<const int32_t>(tree.parents)));
}

}  // namespace

TEST_CASE("kinematics equals products of 4x4 matrices") {
  const auto set = GENERATE(from_range(kernel_sets()));
  const int joints = GENERATE(1, 2, 23, 55);
  const double reach = GENERATE(0.0, 1e-4, 0.4, 3.0);  // angles on both sides of the series' end
  Device& device = test::device(set);
  Tape tape(device, false);
  const Tree tree(joints);
  const std::vector<double> angles = random_values(joints * 3, 2, -reach, reach);
  const Eigen::Vector3d translation(0.3, -0.2, 2.5);
  const JointTransforms got = run(tape, tree, Tensor::from(device, {joints, 3}, std::span<const double>(angles)),
                                  Tensor::from(device, {3}, std::span<const double>(translation.data(), 3)));
  const std::vector<double> expected = expected_matrices(tree, angles, translation);
  CHECK(largest_difference(got.matrices.to_host<double>(), expected) < 3e-6);
  CHECK(largest_difference(matrices_of(got.rotations.to_host<double>()), linear_part(expected)) < 3e-6);
}

TEST_CASE("kinematics gradients pass finite differences at every angle") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const double angle = GENERATE(0.0, 1e-8, 0.5, 1.7, pi - 1e-6, pi, 2 * pi);
  const Tree tree(7);
  std::vector<double> angles = random_values(21, 3);
  for (int j = 0; j < 7; j += 2) {
    const Eigen::Vector3d axis = row(angles, j).normalized() * angle;
    std::copy_n(axis.data(), 3, &angles[j * 3]);
  }
  const Tensor input = Tensor::from(device, {7, 3}, std::span<const double>(angles)).set_requires_gradient();
  const Tensor translation = random_tensor(device, {3}, 4).set_requires_gradient();
  const auto both = [&](Tape& tape, const std::vector<Tensor>& in) {
    const JointTransforms output = run(tape, tree, in[0], in[1]);
    return std::vector{output.matrices, output.rotations};
  };
  CHECK(gradient_check(device, both, {input, translation}) < 1e-6);
  const auto one = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{run(tape, tree, in[0], in[1]).rotations};
  };
  CHECK(gradient_check(device, one, {input, translation}) < 1e-6);
}

TEST_CASE("kinematics gradients in single precision stay finite at the awkward angles") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const double angle = GENERATE(0.0, 1e-30, 1e-8, pi - 1e-6, pi, 2 * pi);
  const Tree tree(3);
  const std::vector<double> angles = {angle, 0, 0, 0, angle, 0, 0, 0, -angle};
  const Tensor input = Tensor::from(device, {3, 3}, std::span<const double>(angles)).set_requires_gradient();
  const Tensor translation = Tensor::zeros(device, {3}).set_requires_gradient();
  Device& exact = test::device(KernelSet::Gpu, Real::Double);
  const Tensor exact_input = Tensor::from(exact, {3, 3}, std::span<const double>(angles)).set_requires_gradient();
  const auto gradient = [&](const Tensor& in, const Tensor& moved) {
    Tape tape(in.device());
    const JointTransforms output = run(tape, tree, in, moved);
    const Tensor weights = random_tensor(in.device(), {3, 4}, 8);
    tape.backward(sum(tape, multiply(tape, output.rotations, weights)));
    return in.gradient().to_host<double>();
  };
  const Tensor exact_translation = Tensor::zeros(exact, {3}).set_requires_gradient();
  CHECK(largest_difference(gradient(input, translation), gradient(exact_input, exact_translation)) < 1e-5);
}
