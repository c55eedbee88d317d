#include "model/train/trained_avatar.h"

#include <algorithm>
#include <functional>
#include <map>

#include "host/error.h"
#include "host/io/checkpoint.h"
#include "host/io/npz.h"
#include "tests/support/catch.h"
#include "tests/support/training_scene.h"
#include "tests/support/training_steps.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

/// Twelve steps with refined poses, without a camera that sees the face.
const RunFolder& trained() {
  static const TemporaryFolder folder;
  static const RunFolder run = [] {
    Config config = tiny_config();
    config.train.iterations = 12;
    config.train.refine_poses = true;
    config.train.pose_learning_rate = 1e-2;
    config.data.hold_out = {"cam02"};
    return train_run(folder / "run", config, *open_scene());
  }();
  return run;
}

std::vector<float> positions(TrainedAvatar& avatar, const Capture& capture, int frame) {
  Tape tape(wide(), false);
  FaceCodes codes = avatar.face_codes(capture);
  return avatar.drive(tape, capture, codes, frame).positions.to_host<float>();
}

/// The trained run with a changed checkpoint.
RunFolder changed_run(const TemporaryFolder& folder, const std::function<void(Checkpoint&)>& change) {
  fs::copy(trained().path(), folder / "run");
  const RunFolder run(folder / "run");
  Checkpoint checkpoint = read_checkpoint(run.checkpoint_file());
  change(checkpoint);
  write_checkpoint(run.checkpoint_file(), checkpoint);
  return run;
}

}  // namespace

TEST_CASE("held-out cameras give no face code, though they see the face") {
  TrainedAvatar avatar(wide(), trained());
  const auto capture = open_scene();
  FaceCodes codes = avatar.face_codes(*capture);
  FaceCodes all(*capture, {0, 1, 2, 3, 4}, {FaceSignal::Code, 4}, [&](int frame, const Camera& camera) {
    return avatar.avatar().frontal_angle(capture->pose(frame), camera);
  });
  for (int frame = 0; frame < capture->frame_count(); ++frame) {
    const std::vector<int>& frontal = all.cameras_of(frame);
    CHECK(std::count(frontal.begin(), frontal.end(), 2) == 1);
    CHECK_FALSE(codes.cameras_of(frame).empty());
    for (int camera : codes.cameras_of(frame)) CHECK(camera != 2);
  }
  const auto novel = open_scene("P1C2");
  FaceCodes novel_codes = avatar.face_codes(*novel);
  for (int camera : novel_codes.cameras_of(0)) CHECK(camera != 2);
  CHECK(avatar.steps_trained() == 12);
}

TEST_CASE("refined poses are used on the capture they were refined on and on no other") {
  TrainedAvatar avatar(wide(), trained());
  const auto capture = open_scene(), novel = open_scene("P1C2");
  CHECK(avatar.is_refined(*capture, 0));
  CHECK(avatar.is_refined(*capture, 5));
  CHECK_FALSE(avatar.is_refined(*novel, 0));
  CHECK_FALSE(avatar.is_refined(*capture, 6));

  const TemporaryFolder folder;
  TrainedAvatar unrefined(wide(), changed_run(folder, [](Checkpoint& checkpoint) {
                            checkpoint.header["refined_frames"] = std::vector<int>{};
                          }));
  CHECK_FALSE(unrefined.is_refined(*capture, 0));
  CHECK(positions(avatar, *capture, 0) != positions(unrefined, *capture, 0));
  CHECK(positions(avatar, *novel, 0) == positions(unrefined, *novel, 0));
}

TEST_CASE("finger angles relative to the mean hand get it added") {
  // The scene's body with a mean hand that closes the fingers.
  const TemporaryFolder folder;
  const RunFolder run = changed_run(folder, [](Checkpoint&) {});
  const NpzFile body(trained().body_file());
  std::map<std::string, NpyArray> arrays;
  for (const std::string& key : body.keys()) arrays[key] = body.read(key);
  const std::vector<float> mean(45, 0.2f);
  arrays["hands_meanl"] = arrays["hands_meanr"] = NpyArray::from({45}, mean);
  write_npz(run.body_file(), arrays);
  TrainedAvatar avatar(wide(), run);
  ChangedCapture flat, relative;
  relative.flat_hands = false;
  const std::vector<float> code(static_cast<size_t>(flat.face_code_size()));
  const DrivingSignal as_it_is = avatar.avatar().signal(flat, 1, code),
                      with_mean = avatar.avatar().signal(relative, 1, code);
  for (size_t joint = 1; joint < 55; ++joint) {
    const float expected = joint >= LeftHandJoint ? 0.2f : 0.0f;
    CHECK(with_mean.joint_angles[3 * (joint - 1)] - as_it_is.joint_angles[3 * (joint - 1)] ==
          Approx(expected).margin(1e-6));
  }
  CHECK(with_mean.pose.axis_angles[RightHandJoint].z() == Approx(as_it_is.pose.axis_angles[RightHandJoint].z() + 0.2));
}

TEST_CASE("what does not fit is refused with file and reason") {
  const TemporaryFolder folder;
  SECTION("no run") {
    CHECK_THROWS_WITH(TrainedAvatar(wide(), RunFolder(folder / "absent")),
                      Contains("absent: no checkpoint.bin") && Contains("degas train --out"));
  }
  SECTION("no body") {
    const RunFolder run = changed_run(folder, [](Checkpoint&) {});
    fs::remove(run.body_file());
    CHECK_THROWS_WITH(TrainedAvatar(wide(), run), Contains("no body.npz"));
  }
  SECTION("codes of another encoder") {
    TrainedAvatar avatar(wide(), trained());
    ChangedCapture capture;
    capture.code_size = 7;
    CHECK_THROWS_WITH(avatar.face_codes(capture), Contains("face codes have 7 values") && Contains("same encoder"));
  }
  SECTION("a header without its keys, or with others' values") {
    const std::string key = GENERATE("config", "pictures", "step", "face_code_size", "betas", "refined_frames");
    const bool missing = GENERATE(true, false);
    const RunFolder run = changed_run(folder, [&](Checkpoint& checkpoint) {
      if (missing)
        checkpoint.header.erase(key);
      else
        checkpoint.header[key] = nullptr;
    });
    CHECK_THROWS_AS(TrainedAvatar(wide(), run), Error);
    CHECK_THROWS_WITH(TrainedAvatar(wide(), run), Contains("checkpoint.bin: "));
  }
  SECTION("arrays of another size") {
    const RunFolder run =
        changed_run(folder, [&](Checkpoint& checkpoint) { checkpoint.header["config"]["net"]["width"] = 0.5; });
    CHECK_THROWS_WITH(TrainedAvatar(wide(), run),
                      Contains("checkpoint.bin: array '") && Contains("this configuration needs"));
  }
  SECTION("a file cut short") {
    const RunFolder run = changed_run(folder, [](Checkpoint&) {});
    fs::resize_file(run.checkpoint_file(), fs::file_size(run.checkpoint_file()) / 2);
    CHECK_THROWS_WITH(TrainedAvatar(wide(), run), Contains("checkpoint.bin: the checkpoint is cut short"));
  }
}

TEST_CASE("refinement leaves the jaw to the face signal") {
  const Checkpoint checkpoint = read_checkpoint(trained().checkpoint_file());
  const std::vector<float>& angles = checkpoint.array(PoseCorrection::name(0, "axis_angles"), 55 * 3);
  for (const int joint : {0, static_cast<int>(HeadJoint), static_cast<int>(LeftEyeJoint)}) {
    CHECK(std::abs(angles[3 * joint]) + std::abs(angles[3 * joint + 1]) + std::abs(angles[3 * joint + 2]) > 0);
  }
  for (int c = 0; c < 3; ++c) CHECK(angles[3 * JawJoint + c] == 0);
}

TEST_CASE("registered expressions and jaws drive a face that was trained with them") {
  const FaceSignal face_signal = GENERATE(FaceSignal::Expression, FaceSignal::Mesh);
  const TemporaryFolder folder;
  Config config = tiny_config();
  config.train.iterations = 2;
  config.face.signal = face_signal;
  config.net.use_world_normals = true;  // as quick.json has it
  const auto capture = open_scene(), novel = open_scene("P1C2");
  const RunFolder run = train_run(folder / "run", config, *capture);
  TrainedAvatar avatar(wide(), run);
  FaceCodes codes = avatar.face_codes(*novel);
  const std::vector<float> code = codes.mean(1);
  CHECK(code.size() == novel->pose(1).expression.size() + 3);
  CHECK(code != codes.mean(0));
  REQUIRE(novel->pose(1).axis_angles[JawJoint].norm() > 0);
  CHECK(avatar.avatar().signal(*novel, 1, code).pose.axis_angles[JawJoint] == novel->pose(1).axis_angles[JawJoint]);
  CHECK(positions(avatar, *novel, 1).size() == static_cast<size_t>(avatar.avatar().gaussian_count()) * 3);
}

TEST_CASE("with a mesh signal the Gaussians ride on the body's expression") {
  const TemporaryFolder folder;
  Config config = tiny_config();
  config.train.iterations = 1;
  config.face.signal = FaceSignal::Mesh;
  TrainedAvatar trained(wide(), train_run(folder / "run", config, *open_scene()));
  Avatar& avatar = trained.avatar();
  Pose pose = avatar.registered_pose(*open_scene(), 0);
  pose.expression.assign(pose.expression.size(), 0.0);
  const auto canonical = [&](std::vector<float> positions) {
    Avatar::Signal signal = avatar.upload(avatar.signal(pose, std::vector<float>(pose.expression.size() + 3)));
    signal.canonical_positions = Tensor::from(wide(), {avatar.gaussian_count(), 3}, std::span<const float>(positions));
    Tape tape(wide(), false);
    return avatar.decode(tape, signal).gaussians.positions.to_host<float>();
  };
  // The same network's answer on a body that the coefficient has moved, and on one that it has not.
  Pose smiling = pose;
  smiling.expression[0] = 1;
  const std::vector<float> code(pose.expression.size() + 3);
  const std::vector<float> rest = avatar.signal(pose, code).canonical_positions;
  const std::vector<float> moved = avatar.signal(smiling, code).canonical_positions;
  REQUIRE(rest != moved);
  const std::vector<float> a = canonical(rest), b = canonical(moved);
  for (size_t i = 0; i < a.size(); ++i) CHECK(b[i] - a[i] == Approx(moved[i] - rest[i]).margin(1e-6));
}

TEST_CASE("a capture without face codes asks for another face signal, and trains without one") {
  const TemporaryFolder folder;
  ChangedCapture capture;
  capture.code_size = 0;
  Config config = tiny_config();
  config.train.iterations = 1;
  CHECK_THROWS_WITH(train_run(folder / "refused", config, capture),
                    Contains("face.signal") && Contains("no face codes") && Contains("none"));
  config.face.signal = FaceSignal::None;
  TrainedAvatar avatar(wide(), train_run(folder / "none", config, capture));
  FaceCodes codes = avatar.face_codes(*open_scene());
  CHECK(codes.mean(0).empty());
}
