// Poses that captures hold for a moment and that users try: twists by half a turn, folded joints, limbs out of sight,
// the camera within the body.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "host/autograd/gradient_check.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/splat_drawing.h"
#include "tests/support/test_devices.h"
#include "tests/support/tiny_subject.h"

using namespace degas;
using namespace degas::test;

namespace {

enum Joint {
  Pelvis = 0,
  LeftKnee = 4,
  RightKnee = 5,
  Neck = 12,
  LeftShoulder = 16,
  RightShoulder = 17,
  LeftElbow = 18,
  RightElbow = 19,
  LeftWrist = 20,
  RightWrist = 21
};

const Eigen::Vector3d along_arm = Eigen::Vector3d::UnitX(), across = Eigen::Vector3d(0.2, 0.3, 1).normalized();

/// Twists of `degrees` at wrists or shoulders or both, elbows, knees and neck folded by nearly as much.
Pose extreme_pose(const BodyModel& body, const std::vector<Joint>& twisted, bool is_folded, double degrees) {
  Pose pose;
  pose.axis_angles.assign(body.joint_count(), Eigen::Vector3d::Zero());
  const double angle = degrees / 180 * M_PI;
  for (const Joint joint : twisted) pose.axis_angles[joint] = angle * along_arm;
  if (is_folded) {
    for (const Joint joint : {LeftElbow, RightElbow, LeftKnee, RightKnee, Neck}) {
      pose.axis_angles[joint] = 0.95 * angle * across;
    }
  }
  pose.translation = {0.3, -0.4, 2};
  return pose;
}

std::vector<Pose> extreme_poses(const BodyModel& body, double degrees) {
  const std::vector<Joint> wrists = {LeftWrist, RightWrist}, shoulders = {LeftShoulder, RightShoulder},
                           all = {Pelvis, LeftShoulder, RightShoulder, LeftWrist, RightWrist};
  return {extreme_pose(body, wrists, false, degrees), extreme_pose(body, shoulders, false, degrees),
          extreme_pose(body, {}, true, degrees), extreme_pose(body, all, true, degrees)};
}

/// Splats of a device, on the host.
SplatScene scene_of(const Splats& splats) {
  return {splats.positions.to_host<double>(), splats.rotations.to_host<double>(), splats.log_scales.to_host<double>(),
          splats.opacities.to_host<double>(), splats.colors.to_host<double>()};
}

SplatScene posed_scene(Device& device, const TinySubject& subject, const Pose& pose) {
  Tape tape(device, false);
  return scene_of(subject.posed(tape, subject.heads(device, 0.5), make_device_pose(device, pose)));
}

Eigen::Vector3d position_of(const SplatScene& scene, int64_t n) {
  return Eigen::Map<const Eigen::Vector3d>(&scene.positions[3 * n]);
}

Eigen::Vector3d middle_of(const SplatScene& scene) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int64_t n = 0; n < scene.count(); ++n) sum += position_of(scene, n);
  return sum / static_cast<double>(scene.count());
}

/// Looks along +z, 64 x 64 pixels, from `distance` before a point.
Camera camera_before(const Eigen::Vector3d& point, double distance) {
  Camera camera;
  camera.width = camera.height = 64;
  camera.fx = camera.fy = 60;
  camera.cx = 31, camera.cy = 33;
  camera.translation = Eigen::Vector3d(0, 0, distance) - point;
  return camera;
}

/// With the smooth cut-off no pixel depends on which side of 1/255 it is by rounding.
SplatOptions smooth() {
  SplatOptions options;
  options.smooth_cutoff = true;
  return options;
}

/// Image and gradients in single precision against the independent renderer and double precision.
Drawn check_drawing(KernelSet kernel_set, const SplatScene& scene, const Camera& camera) {
  const Drawn drawn = draw(test::device(kernel_set), scene, camera, smooth());
  const ReferenceImage reference = reference_render(scene, camera, drawing_background, smooth());
  CHECK(largest_difference(drawn.color, reference.color) < 5e-5);
  CHECK(largest_difference(drawn.alpha, reference.alpha) < 5e-5);
  CHECK(*std::max_element(reference.alpha.begin(), reference.alpha.end()) > 0.5);
  const Drawn expected = draw(test::device(kernel_set, Real::Double), scene, camera, smooth());
  CHECK(gradient_difference(drawn, expected) < 1e-4);
  return drawn;
}

}  // namespace

TEST_CASE("twists by half a turn and folded joints leave true rotations, where the joints put them") {
  const KernelSet kernel_set = GENERATE(from_range(kernel_sets()));
  Device& device = test::device(kernel_set);
  const TinySubject subject;
  const double degrees = GENERATE(150.0, 179.0, 180.0);
  int number = 0;
  for (const Pose& pose : extreme_poses(subject.body, degrees)) {
    CAPTURE(degrees, number++);
    Tape tape(device, false);
    const CanonicalGaussians canonical =
        assemble(tape, subject.heads(device, 0.5), make_gaussian_base(device, subject.maps));
    const auto points = canonical.positions.to_host<double>(), turns = canonical.rotations.to_host<double>();
    const SplatScene posed = posed_scene(device, subject, pose);
    const JointFrames frames = subject.body.posed_joints(pose, subject.betas);
    const std::vector<Eigen::Vector3d> rest = subject.body.joints(subject.betas);
    int clear = 0;
    double worst_position = 0, worst_norm = 0, worst_rotation = 0;
    for (int64_t n = 0; n < posed.count(); ++n) {
      const Eigen::Vector3d point(&points[3 * n]);
      const auto quaternion_at = [n](const std::vector<double>& all) {
        return Eigen::Quaterniond(all[4 * n], all[4 * n + 1], all[4 * n + 2], all[4 * n + 3]);
      };
      Eigen::Vector3d moved = Eigen::Vector3d::Zero();
      Eigen::Vector4d blend = Eigen::Vector4d::Zero(), heaviest = Eigen::Vector4d::Zero();
      double nearest_side = 1;
      for (int k = 0; k < subject.maps.influences; ++k) {
        const int joint = subject.maps.joints[n * subject.maps.influences + k];
        const double weight = subject.maps.weights[n * subject.maps.influences + k];
        moved += weight * (frames.rotations[joint] * (point - rest[joint]) + frames.positions[joint]);
        const Eigen::Vector4d turn = Eigen::Quaterniond(frames.rotations[joint]).coeffs();
        if (k == 0) heaviest = turn;
        const double side = turn.dot(heaviest);
        blend += (side < 0 ? -weight : weight) * turn;
        if (weight > 0) nearest_side = std::min(nearest_side, std::abs(side));
      }
      worst_position = std::max(worst_position, (position_of(posed, n) - moved).norm());
      const Eigen::Quaterniond actual = quaternion_at(posed.rotations);
      worst_norm = std::max(worst_norm, std::abs(actual.norm() - 1));
      if (nearest_side < 1e-3) continue;  // half a turn may be halved either way round
      ++clear;
      const Eigen::Quaterniond expected = Eigen::Quaterniond(blend.normalized()) * quaternion_at(turns);
      worst_rotation =
          std::max(worst_rotation, (actual.toRotationMatrix() - expected.toRotationMatrix()).cwiseAbs().maxCoeff());
    }
    CHECK(worst_position < 1e-5);
    // Of unit length, so that covariances keep their determinants.
    CHECK(worst_norm < 1e-6);
    CHECK(worst_rotation < 1e-4);
    if (degrees < 180) CHECK(clear > posed.count() * 9 / 10);
    check_drawing(kernel_set, posed, camera_before(middle_of(posed), 2));
  }
}

TEST_CASE("gradients of extreme poses pass finite differences, and are finite at half a turn") {
  const KernelSet kernel_set = GENERATE(from_range(kernel_sets()));
  const TinySubject subject;
  const auto inputs_of = [&](Device& device, const Pose& pose) {
    const AssemblyMaps heads = subject.heads(device, 0.5);
    const DevicePose on_device = make_device_pose(device, pose);
    std::vector<Tensor> inputs = {heads.positions, heads.rotations_scales, heads.colors_opacities,
                                  on_device.axis_angles, on_device.translation};
    for (Tensor& input : inputs) input.set_requires_gradient();
    return inputs;
  };
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    const Splats s = subject.posed(tape, {in[0], in[1], in[2], {}}, {in[3], in[4]});
    return std::vector{s.positions, s.rotations, s.log_scales, s.opacities, s.colors};
  };
  GradientCheckOptions check;
  check.step = 1e-6;
  Device& exact = test::device(kernel_set, Real::Double);
  for (const Pose& pose : extreme_poses(subject.body, 179)) {
    CHECK(gradient_check(exact, function, inputs_of(exact, pose), check) < 1e-5);
  }
  Device& single = test::device(kernel_set);
  for (const Pose& pose : extreme_poses(subject.body, 180)) {
    const std::vector<Tensor> inputs = inputs_of(single, pose);
    const Eigen::Vector3d middle = middle_of(posed_scene(single, subject, pose));
    Tape tape(single);
    SplatWorkspace workspace;
    const Splats s = subject.posed(tape, {inputs[0], inputs[1], inputs[2], {}}, {inputs[3], inputs[4]});
    const Tensor color = splat(tape, workspace, s, camera_before(middle, 2), drawing_background).color;
    tape.backward(sum(tape, multiply(tape, color, color)));
    for (const Tensor& input : inputs) {
      const std::vector<double> gradient = input.gradient().to_host<double>();
      CHECK(all_finite(gradient));
      CHECK(!all_zero(gradient));
    }
  }
}

TEST_CASE("limbs out of sight add nothing but what reaches in") {
  const KernelSet kernel_set = GENERATE(from_range(kernel_sets()));
  const TinySubject subject(64);  // Gaussians that are small beside the limbs
  const Pose pose = extreme_poses(subject.body, 150)[GENERATE(0, 3)];
  const SplatScene scene = posed_scene(test::device(kernel_set), subject, pose);
  // So near that most of the person is beside the picture.
  Camera camera = camera_before(middle_of(scene), 0.7);
  camera.fx = camera.fy = 150;
  const Drawn drawn = check_drawing(kernel_set, scene, camera);
  SplatScene moved = scene;
  int outside = 0;
  for (int64_t n = 0; n < scene.count(); ++n) {
    // Farther out than its deviations reach, the Jacobian's stretch included.
    const Eigen::Vector3d seen = camera.project(position_of(scene, n));
    const double largest = *std::max_element(&scene.log_scales[3 * n], &scene.log_scales[3 * n] + 3);
    const double reach = 4 * (1.5 * std::exp(largest) / seen.z() * camera.fx + 1);
    const double beyond = std::max({-seen.x(), seen.x() - 64, -seen.y(), seen.y() - 64});
    if (seen.z() < 0.1 || beyond < reach) continue;
    ++outside;
    for (int axis = 0; axis < 3; ++axis) {
      moved.positions[3 * n + axis] += position_of(scene, n)[axis] - middle_of(scene)[axis];
    }
  }
  CHECK(outside > 10);
  CHECK(outside < scene.count());
  const Drawn again = draw(test::device(kernel_set), moved, camera, smooth());
  CHECK(again.color == drawn.color);
  CHECK(again.gradients == drawn.gradients);
}

TEST_CASE("a camera within the body sees what lies before it, and nothing of what lies behind") {
  const KernelSet kernel_set = GENERATE(from_range(kernel_sets()));
  const TinySubject subject;
  const Pose pose = extreme_poses(subject.body, 150)[GENERATE(0, 1, 2, 3)];
  const SplatScene scene = posed_scene(test::device(kernel_set), subject, pose);
  // At the middle, looking along the body's surface, so that Gaussians are at every depth from the near plane on.
  Camera camera = camera_before(middle_of(scene), 0);
  camera.rotation = Eigen::AngleAxisd(GENERATE(0.3, 1.6, 4.0), Eigen::Vector3d(0.3, 1, 0.2).normalized()).matrix();
  camera.translation = -camera.rotation * middle_of(scene);
  const Drawn drawn = check_drawing(kernel_set, scene, camera);
  CHECK(all_finite(drawn));
  SplatScene moved = scene;
  int behind = 0;
  const double near_plane = SplatOptions{}.near_plane;
  for (int64_t n = 0; n < scene.count(); ++n) {
    const double depth = camera.project(position_of(scene, n)).z();
    CHECK(std::abs(depth - near_plane) > 1e-6);  // else rounding decides
    if (depth >= near_plane) continue;
    ++behind;
    const Eigen::Vector3d back = -camera.rotation.row(2) * (0.1 * static_cast<double>(n % 5));
    for (int axis = 0; axis < 3; ++axis) {
      moved.positions[3 * n + axis] += back[axis];
      moved.log_scales[3 * n + axis] += 3;
    }
    for (int f = 0; f < 5; ++f) {
      const auto& gradient = drawn.gradients[f];
      const auto size = static_cast<int64_t>(gradient.size()) / scene.count();
      CHECK(all_zero({gradient.begin() + n * size, gradient.begin() + (n + 1) * size}));
    }
  }
  CHECK(behind > scene.count() / 10);
  CHECK(behind < scene.count() * 9 / 10);
  const Drawn again = draw(test::device(kernel_set), moved, camera, smooth());
  CHECK(again.color == drawn.color);
  CHECK(again.alpha == drawn.alpha);
  CHECK(again.gradients == drawn.gradients);
}
