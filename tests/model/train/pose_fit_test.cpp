#include "model/train/pose_fit.h"

#include <numeric>

#include "model/train/fitted_poses.h"
#include "tests/support/catch.h"
#include "tests/support/training_scene.h"
#include "tests/support/training_steps.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

constexpr size_t left_shoulder = 16;  // in SMPL-X's order

/// Long enough that the person is seen.
const RunFolder& trained() {
  static const TemporaryFolder folder;
  static const RunFolder run = [] {
    Config config = tiny_config();
    config.train.iterations = 150;
    config.train.learning_rate = 5e-3;
    config.data.hold_out = {"cam02"};
    return train_run(folder / "run", config, *open_scene());
  }();
  return run;
}

PoseFitOptions all_cameras(const Capture& capture) {
  PoseFitOptions options;
  options.cameras.resize(capture.camera_names().size());
  std::iota(options.cameras.begin(), options.cameras.end(), 0);
  return options;
}

/// A tracker that is 2 cm off, and 10 degrees at the left shoulder.
ChangedCapture badly_registered() {
  ChangedCapture capture;
  capture.change_pose = [](int, Pose& pose) {
    pose.translation += Eigen::Vector3d(0.02, 0, 0);
    pose.axis_angles[left_shoulder] += Eigen::Vector3d(0, 0, 0.17);
  };
  return capture;
}

/// Mean distance between the vertices of two poses, metres, of those that move with the left arm or of all.
double distance(const Avatar& avatar, const Pose& a, const Pose& b, bool of_left_arm) {
  const auto at = [&](const Pose& pose) { return avatar.body().posed_vertices(pose, avatar.betas(), true); };
  const std::vector<Eigen::Vector3d> first = at(a), second = at(b);
  Pose raised = b;
  raised.axis_angles[left_shoulder].y() += 0.5;
  const std::vector<Eigen::Vector3d> moving = at(raised);
  double sum = 0;
  int count = 0;
  for (size_t i = 0; i < first.size(); ++i) {
    if (of_left_arm && (moving[i] - second[i]).norm() < 0.05) continue;
    sum += (first[i] - second[i]).norm();
    ++count;
  }
  return sum / count;
}

}  // namespace

TEST_CASE("a pose that was registered beside the person is fitted back to it, by either kernel set") {
  const auto set = GENERATE(from_range(kernel_sets()));
  TrainedAvatar avatar(device(set), trained());
  const auto right = open_scene();
  const ChangedCapture wrong = badly_registered();
  const FittedPose fitted = PoseFitter(device(set), avatar, wrong, all_cameras(wrong)).fit(3);
  const Pose truth = right->pose(3), before = wrong.pose(3);
  CAPTURE(fitted.loss_before, fitted.loss_after, fitted.pose.translation.transpose(), truth.translation.transpose());
  CHECK(fitted.views == 5);
  CHECK(fitted.loss_after < 0.7 * fitted.loss_before);
  CHECK((fitted.pose.translation - truth.translation).norm() < 0.3 * (before.translation - truth.translation).norm());
  for (const bool of_left_arm : {false, true}) {
    const double now = distance(avatar.avatar(), fitted.pose, truth, of_left_arm),
                 then = distance(avatar.avatar(), before, truth, of_left_arm);
    CAPTURE(of_left_arm, now, then);
    CHECK(now < 0.3 * then);
  }
  CHECK(fitted.metres_moved == Approx((fitted.pose.translation - before.translation).norm()));
  CHECK(fitted.degrees_moved > 2);

  SECTION("what pictures do not tell about stays: the jaw, which is the face signal's, and the expression") {
    CHECK(fitted.pose.axis_angles[JawJoint] == before.axis_angles[JawJoint]);
    CHECK(fitted.pose.expression == before.expression);
  }
  SECTION("the same frame gives the same bits") {
    TrainedAvatar again(device(set), trained());
    const FittedPose same = PoseFitter(device(set), again, wrong, all_cameras(wrong)).fit(3);
    CHECK(same.pose.axis_angles == fitted.pose.axis_angles);
    CHECK(same.pose.translation == fitted.pose.translation);
  }
}

TEST_CASE("pictures of cameras that are not named are not looked at") {
  TrainedAvatar avatar(wide(), trained());
  ChangedCapture wrong = badly_registered();
  PoseFitOptions two;
  two.cameras = {0, 3};
  const FittedPose fitted = PoseFitter(wide(), avatar, wrong, two).fit(1);
  CHECK(fitted.views == 2);
  wrong.change_sample = [](Sample& sample) {
    if (sample.camera != 0 && sample.camera != 3) FAIL("camera " << sample.camera << " was read");
  };
  CHECK(PoseFitter(wide(), avatar, wrong, two).fit(1).pose.translation == fitted.pose.translation);
}

TEST_CASE("a frame without a picture keeps its pose") {
  TrainedAvatar avatar(wide(), trained());
  ChangedCapture capture = badly_registered();
  capture.lacks_image = [](int frame, int) { return frame == 2; };
  const FittedPose fitted = PoseFitter(wide(), avatar, capture, all_cameras(capture)).fit(2);
  CHECK(fitted.views == 0);
  CHECK(fitted.pose.translation == capture.pose(2).translation);
  CHECK(fitted.pose.axis_angles == capture.pose(2).axis_angles);
}

TEST_CASE("a fit that draws no better leaves the pose") {
  TrainedAvatar avatar(wide(), trained());
  const auto capture = open_scene();
  PoseFitOptions options = all_cameras(*capture);
  options.steps = 1;  // of a millimetre and a milliradian, whatever the gradient
  PoseFitter fitter(wide(), avatar, *capture, options);
  int left = 0;
  for (int frame = 0; frame < capture->frame_count(); ++frame) {
    const FittedPose fitted = fitter.fit(frame);
    CHECK(fitted.loss_after <= fitted.loss_before);
    const bool moved = fitted.pose.translation != capture->pose(frame).translation;
    CHECK(moved == (fitted.loss_after < fitted.loss_before));
    left += !moved;
  }
  CAPTURE(left);
}

TEST_CASE("fitted poses are kept as body parameters, and gone on with") {
  const TemporaryFolder folder;
  TrainedAvatar avatar(wide(), trained());
  const auto capture = open_scene();
  const PoseFitOptions options = all_cameras(*capture);
  FittedPoses poses(folder / "poses.npz", avatar, *capture, options);
  FittedPose fitted;
  fitted.pose = capture->pose(4);
  fitted.pose.translation.x() += 0.5;
  fitted.views = 5;
  fitted.loss_before = 0.2;
  fitted.loss_after = 0.1;
  fitted.metres_moved = 0.5;
  poses.set(4, fitted);
  CHECK_THAT(poses.summary(),
             Contains("1 frames fitted to 5 pictures") && Contains("0.20000 -> 0.10000") && Contains("500.0 mm"));
  poses.save();

  const SmplxParameters kept = read_smplx_parameters(folder / "poses.npz");
  CHECK(kept.poses[4].translation.x() == Approx(capture->pose(4).translation.x() + 0.5));
  CHECK(kept.poses[3].translation.isApprox(capture->pose(3).translation, 1e-6));
  CHECK(kept.flat_hand_mean);

  FittedPoses again(folder / "poses.npz", avatar, *capture, options);
  CHECK_FALSE(again.has(4));
  again.resume();
  CHECK(again.has(4));
  CHECK_FALSE(again.has(3));
  PoseFitOptions fewer = options;
  fewer.cameras.pop_back();
  CHECK_THROWS_WITH(FittedPoses(folder / "poses.npz", avatar, *capture, fewer).resume(),
                    Contains("poses.npz: was fitted by") && Contains("leave --resume away"));
  CHECK_THROWS_WITH(FittedPoses(training_scene() / "P1C1" / "smplx.npz", avatar, *capture, options).resume(),
                    Contains("has no 'fitted'") && Contains("leave --resume away"));
}
