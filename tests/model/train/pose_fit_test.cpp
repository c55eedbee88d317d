#include "model/train/pose_fit.h"

#include <numeric>

#include "host/error.h"
#include "model/data/registration.h"
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
Config long_config() {
  Config config = tiny_config();
  config.train.iterations = 150;
  config.train.learning_rate = 5e-3;
  config.data.hold_out = {"cam02"};
  return config;
}

const RunFolder& trained() {
  static const TemporaryFolder folder;
  static const RunFolder run = train_run(folder / "run", long_config(), *open_scene());
  return run;
}

FittedPose fit(KernelSet set, TrainedAvatar& avatar, const Capture& capture, int frame, const PoseFitOptions& options) {
  const auto fitted = PoseFitter(device(set), avatar, capture, options).fit(frame);
  REQUIRE(fitted);
  return *fitted;
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
  const FittedPose fitted = fit(set, avatar, wrong, 3, all_cameras(wrong));
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

  SECTION("what pictures do not tell about stays: eyes and finger tips") {
    for (const int joint : {23, 24, 27, 42})
      CHECK((fitted.pose.axis_angles[joint] - before.axis_angles[joint]).norm() < 2e-3);
  }
  SECTION("so do the jaw, which is the face signal's, and the expression") {
    CHECK(fitted.pose.axis_angles[JawJoint] == before.axis_angles[JawJoint]);
    CHECK(fitted.pose.expression == before.expression);
  }
  SECTION("the same frame gives the same bits") {
    TrainedAvatar again(device(set), trained());
    const FittedPose same = fit(set, again, wrong, 3, all_cameras(wrong));
    CHECK(same.pose.axis_angles == fitted.pose.axis_angles);
    CHECK(same.pose.translation == fitted.pose.translation);
  }
}

TEST_CASE("pictures of cameras that are not named are not looked at") {
  TrainedAvatar avatar(wide(), trained());
  ChangedCapture wrong = badly_registered();
  PoseFitOptions two;
  two.cameras = {0, 3};
  const FittedPose fitted = fit(KernelSet::Wide, avatar, wrong, 1, two);
  CHECK(fitted.views == 2);
  wrong.change_sample = [](Sample& sample) {
    if (sample.camera != 0 && sample.camera != 3) FAIL("camera " << sample.camera << " was read");
  };
  CHECK(fit(KernelSet::Wide, avatar, wrong, 1, two).pose.translation == fitted.pose.translation);
  CHECK_THROWS_WITH(PoseFitter(wide(), avatar, wrong, {}), Contains("--cameras"));
}

TEST_CASE("a frame without a picture keeps its pose") {
  TrainedAvatar avatar(wide(), trained());
  ChangedCapture capture = badly_registered();
  capture.lacks_image = [](int frame, int) { return frame == 2; };
  const FittedPose fitted = fit(KernelSet::Wide, avatar, capture, 2, all_cameras(capture));
  CHECK(fitted.views == 0);
  CHECK(fitted.pose.translation == capture.pose(2).translation);
  CHECK(fitted.pose.axis_angles == capture.pose(2).axis_angles);
}

TEST_CASE("a fit that draws no better leaves the pose") {
  // One step of half a metre and half a radian.
  const TemporaryFolder folder;
  Config config = long_config();
  config.train.iterations = 20;
  config.train.pose_learning_rate = 0.5;
  TrainedAvatar avatar(wide(), train_run(folder / "run", config, *open_scene()));
  const auto capture = open_scene();
  PoseFitOptions options = all_cameras(*capture);
  options.steps = 1;
  const FittedPose fitted = fit(KernelSet::Wide, avatar, *capture, 0, options);
  CHECK(fitted.views == 5);
  CHECK(fitted.loss_after == fitted.loss_before);
  CHECK(fitted.pose.translation == capture->pose(0).translation);
  CHECK(fitted.metres_moved == 0);
}

TEST_CASE("a fit begins with the poses that training refined, and they are not applied again to what it wrote") {
  const TemporaryFolder folder;
  Config config = long_config();
  config.train.iterations = 12;
  config.train.refine_poses = true;
  config.train.pose_learning_rate = 1e-2;
  TrainedAvatar avatar(wide(), train_run(folder / "run", config, *open_scene()));
  const auto capture = open_scene();
  REQUIRE(avatar.is_refined(*capture, 3));
  const Pose refined = avatar.best_pose(*capture, 3);
  CHECK((refined.translation - capture->pose(3).translation).norm() > 1e-3);
  CHECK(refined.axis_angles[JawJoint] == capture->pose(3).axis_angles[JawJoint]);
  // By the same correction as the skeleton on the device has.
  Tape tape(wide(), false);
  FaceCodes codes = avatar.face_codes(*capture);
  const auto drawn = avatar.drive(tape, *capture, codes, 3).positions.to_host<float>();
  const Avatar::Signal signal = avatar.avatar().upload(avatar.avatar().signal(*capture, 3, codes.mean(3)));
  const DevicePose host_refined = make_device_pose(wide(), avatar.avatar().driven_pose(refined));
  const auto expected = avatar.avatar().pose(tape, avatar.avatar().decode(tape, signal).gaussians, host_refined);
  const auto positions = expected.positions.to_host<float>();
  for (size_t i = 0; i < drawn.size(); i += 7) CHECK(drawn[i] == Approx(positions[i]).margin(1e-5));

  FittedPoses(folder / "poses.npz", avatar, *capture, all_cameras(*capture)).save();
  const auto fitted = with_registration(open_scene(), folder / "poses.npz");
  CHECK_FALSE(avatar.is_refined(*fitted, 3));
  CHECK(avatar.best_pose(*fitted, 3).translation.isApprox(refined.translation, 1e-6));
}

TEST_CASE("a fit that is stopped keeps the frames that were done") {
  const TemporaryFolder folder;
  TrainedAvatar avatar(wide(), trained());
  const auto capture = open_scene();
  PoseFitOptions options = all_cameras(*capture);
  options.steps = 3;
  int asked = 0;
  options.stop_requested = [&] { return ++asked > 4; };  // in the second frame
  FittedPoses poses(folder / "poses.npz", avatar, *capture, options);
  PoseFitter fitter(wide(), avatar, *capture, options);
  std::vector<int> told;
  const auto tell = [&](int done, const FittedPose&) { told.push_back(done); };
  CHECK_FALSE(fit_frames(fitter, poses, {1, 4}, tell));
  CHECK(told == std::vector<int>{1});
  FittedPoses kept(folder / "poses.npz", avatar, *capture, options);
  kept.resume();
  CHECK(kept.has(1));
  CHECK_FALSE(kept.has(4));
}

TEST_CASE("an Error in the middle keeps the frames that were done, and frames without any picture are one") {
  const TemporaryFolder folder;
  TrainedAvatar avatar(wide(), trained());
  ChangedCapture capture;
  PoseFitOptions options = all_cameras(capture);
  options.steps = 1;
  FittedPoses poses(folder / "poses.npz", avatar, capture, options);
  PoseFitter fitter(wide(), avatar, capture, options);
  const auto ignore = [](int, const FittedPose&) {};
  capture.lacks_image = [](int, int) { return true; };
  CHECK_THROWS_WITH(fit_frames(fitter, poses, {0}, ignore), Contains("none of the chosen frames has a picture"));
  CHECK_FALSE(std::filesystem::exists(folder / "poses.npz"));
  capture.lacks_image = {};
  capture.change_sample = [](Sample& sample) {
    if (sample.frame == 3) throw Error("a picture that cannot be read");
  };
  CHECK_THROWS_WITH(fit_frames(fitter, poses, {2, 3}, ignore), Contains("cannot be read"));
  FittedPoses kept(folder / "poses.npz", avatar, capture, options);
  kept.resume();
  CHECK(kept.has(2));
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
  CHECK(kept.betas == avatar.avatar().betas());
  TrainedAvatar another(wide(), [&] {
    Config config = long_config();
    config.train.iterations = 3;
    return train_run(folder / "another", config, *capture);
  }());
  CHECK_THROWS_WITH(FittedPoses(folder / "poses.npz", another, *capture, options).resume(),
                    Contains("poses.npz: was fitted by"));
  PoseFitOptions fewer = options;
  fewer.cameras.pop_back();
  CHECK_THROWS_WITH(FittedPoses(folder / "poses.npz", avatar, *capture, fewer).resume(),
                    Contains("poses.npz: was fitted by") && Contains("leave --resume away"));
  CHECK_THROWS_WITH(FittedPoses(training_scene() / "P1C1" / "smplx.npz", avatar, *capture, options).resume(),
                    Contains("has no 'fitted'") && Contains("leave --resume away"));
}
