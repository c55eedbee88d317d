#include "model/inspect/diagnosis.h"

#include <algorithm>

#include "model/data/synthetic_capture.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/training_scene.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

/// A synthetic capture of pictures large enough to tell arms from sleeves, made once.
const std::filesystem::path& scene() {
  static const TemporaryFolder folder;
  static const bool written = [] {
    SyntheticOptions options;
    options.frames = 5;
    options.novel_frames = 1;
    options.views = 5;
    options.width = 120;
    options.height = 160;
    write_synthetic_capture(folder.path(), options);
    return true;
  }();
  static_cast<void>(written);
  return folder.path();
}

std::unique_ptr<Capture> open_it() {
  CaptureOptions options;
  options.cache = scene() / "cache";
  return open_capture(scene() / "P1C1", options);
}

Diagnosis diagnosis_of(const Capture& capture) {
  static const BodyModel body = BodyModel::load(scene() / "body.npz");
  std::vector<MaskView> views;
  for (int camera = 0; camera < static_cast<int>(capture.camera_names().size()); ++camera) {
    for (int frame = 0; frame < capture.frame_count(); ++frame) {
      const Sample sample = capture.load(frame, camera);
      views.push_back({frame, camera, sample.view, sample.mask});
    }
  }
  return diagnose(FitTrials(capture, body, std::move(views), 2), capture.camera_names());
}

Image8 mirrored(const Image8& image) {
  Image8 out = image;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) std::copy_n(image.at(image.width - 1 - x, y), image.channels, out.at(x, y));
  }
  return out;
}

}  // namespace

TEST_CASE("a capture that is read rightly raises no suspicion") {
  const Diagnosis diagnosis = diagnosis_of(ChangedCapture(open_it()));
  CHECK(diagnosis.mask_iou > 0.7);
  CAPTURE(diagnosis.sentences);
  CHECK(diagnosis.suspected.empty());
  CHECK(diagnosis.sentences.empty());
  for (const auto& trial : diagnosis.trials) {
    CAPTURE(trial.name, trial.mask_iou);
    CHECK(trial.mask_iou <= diagnosis.mask_iou + 1e-9);
  }
}

TEST_CASE("planted mistakes are named, and undoing them restores the fit") {
  struct Plant {
    const char* name;
    void (*change)(ChangedCapture&);
  };
  const Plant plant = GENERATE(
      Plant{"flipped_y",
            [](ChangedCapture& c) {
              c.change_camera = [](Camera& camera) {
                camera.rotation.row(1) *= -1;
                camera.translation[1] *= -1;
              };
            }},
      Plant{"flipped_y",
            [](ChangedCapture& c) { c.change_camera = [](Camera& camera) { camera.rotation.col(1) *= -1; }; }},
      Plant{"flipped_y",
            [](ChangedCapture& c) {
              c.change_camera = [](Camera& camera) {
                const Eigen::Vector3d center = Eigen::Vector3d(1, -1, 1).asDiagonal() * camera.center();
                camera.translation = -camera.rotation * center;
              };
            }},
      Plant{"flipped_yz",
            [](ChangedCapture& c) {
              c.change_camera = [](Camera& camera) { camera.rotation *= Eigen::Vector3d(1, -1, -1).asDiagonal(); };
            }},
      Plant{"swapped_yz",
            [](ChangedCapture& c) {
              c.change_camera = [](Camera& camera) {
                Eigen::Matrix3d turn;
                turn << 1, 0, 0, 0, 0, 1, 0, -1, 0;
                camera.rotation *= turn;
              };
            }},
      Plant{"opengl_camera_axes",
            [](ChangedCapture& c) {
              c.change_camera = [](Camera& camera) {
                camera.rotation = Eigen::Vector3d(1, -1, -1).asDiagonal() * camera.rotation;
                camera.translation = Eigen::Vector3d(1, -1, -1).asDiagonal() * camera.translation;
              };
            }},
      Plant{"camera_to_world",
            [](ChangedCapture& c) {
              c.change_camera = [](Camera& camera) {
                const Eigen::Vector3d center = camera.center();
                camera.rotation.transposeInPlace();
                camera.translation = center;
              };
            }},
      Plant{"transposed_rotation",
            [](ChangedCapture& c) { c.change_camera = [](Camera& camera) { camera.rotation.transposeInPlace(); }; }},
      Plant{"transposed_rotation",
            [](ChangedCapture& c) {
              c.change_camera = [](Camera& camera) {
                const Eigen::Vector3d center = camera.center();
                camera.rotation.transposeInPlace();
                camera.translation = -camera.rotation * center;
              };
            }},
      Plant{"millimetres",
            [](ChangedCapture& c) { c.change_camera = [](Camera& camera) { camera.translation *= 1000; }; }},
      Plant{"millimetres",
            [](ChangedCapture& c) {
              c.change_pose = [](int, Pose& pose) {
                pose.translation = 1000 * (pose.translation + Eigen::Vector3d(0, 0.1, 0));
              };
              c.change_camera = [](Camera& camera) {
                camera.translation -= camera.rotation * Eigen::Vector3d(0, 0.1, 0);
              };
            }},
      Plant{"mirrored_image", [](ChangedCapture& c) {
              c.change_sample = [](Sample& sample) {
                sample.image = mirrored(sample.image);
                sample.mask = mirrored(sample.mask);
              };
            }});
  static const double whole = diagnosis_of(ChangedCapture(open_it())).mask_iou;
  ChangedCapture planted(open_it());
  plant.change(planted);
  const Diagnosis diagnosis = diagnosis_of(planted);
  CAPTURE(plant.name, diagnosis.mask_iou, diagnosis.suspected, diagnosis.sentences);
  REQUIRE(diagnosis.suspected.size() == 1);
  CHECK(diagnosis.suspected[0] == plant.name);
  CHECK(diagnosis.trials[0].name == plant.name);
  CHECK(diagnosis.mask_iou < whole - 0.1);
  CHECK(diagnosis.trials[0].mask_iou > whole - 0.02);
  REQUIRE(diagnosis.sentences.size() == 1);
  CHECK_THAT(diagnosis.sentences[0], Contains(std::string(plant.name) + ": ") && Contains("as read"));
}

TEST_CASE("fingers by principal components are looked at as they are meant") {
  const Diagnosis by_angles = diagnosis_of(*open_it());
  ChangedCapture by_components(open_it());
  by_components.change_pose = [](int, Pose& pose) {  // the components of the scene's body are the angles one by one
    for (int i = 0; i < 90; ++i) {
      double& angle = pose.axis_angles[LeftHandJoint + i / 3][i % 3];
      pose.hand_coefficients[i / 45].push_back(angle);
      angle = 0;
    }
  };
  CHECK(diagnosis_of(by_components).mask_iou == by_angles.mask_iou);
  by_components.change_pose = [](int, Pose& pose) { pose.hand_coefficients[0].assign(46, 1); };
  CHECK_THROWS_WITH(diagnosis_of(by_components), Contains("body.npz: 'hands_componentsl' has 45 rows"));
}

TEST_CASE("pictures that are a frame late or early are named") {
  const int offset = GENERATE(-1, 1);
  ChangedCapture planted(open_it());
  planted.change_pose = [offset, source = std::shared_ptr<Capture>(open_it())](int frame, Pose& pose) {
    pose = source->pose(std::clamp(frame - offset, 0, 4));
  };
  const Diagnosis diagnosis = diagnosis_of(planted);
  CAPTURE(diagnosis.mask_iou, diagnosis.suspected, diagnosis.sentences);
  REQUIRE(diagnosis.suspected.size() == 1);
  CHECK(diagnosis.suspected[0] == (offset > 0 ? "frame_offset_+1" : "frame_offset_-1"));
}

TEST_CASE("rows that stand for every fourth frame are not called a frame off") {
  class Sparse : public ChangedCapture {
   public:
    using ChangedCapture::ChangedCapture;
    int64_t frame_number(int frame) const override { return 4 * frame; }
  };
  Sparse planted(open_it());
  planted.change_pose = [source = std::shared_ptr<Capture>(open_it())](int frame, Pose& pose) {
    pose = source->pose(std::clamp(frame - 1, 0, 4));
  };
  const Diagnosis diagnosis = diagnosis_of(planted);
  CAPTURE(diagnosis.suspected);
  CHECK(diagnosis.suspected.empty());
  for (const auto& trial : diagnosis.trials) CHECK_THAT(trial.name, !Contains("frame_offset"));
  CHECK(diagnosis.trials.size() > 5);
}

TEST_CASE("two mistakes at once are both found") {
  ChangedCapture planted(open_it());
  planted.change_camera = [](Camera& camera) { camera.translation *= 1000; };
  planted.change_sample = [](Sample& sample) { sample.mask = mirrored(sample.mask); };
  const Diagnosis diagnosis = diagnosis_of(planted);
  CAPTURE(diagnosis.suspected, diagnosis.sentences);
  const auto has = [&](const char* name) {
    return std::count(diagnosis.suspected.begin(), diagnosis.suspected.end(), name) == 1;
  };
  CHECK(has("millimetres"));
  CHECK(has("mirrored_image"));
}

TEST_CASE("a single camera that is wrong is named") {
  ChangedCapture planted(open_it());
  const std::string mistake = GENERATE("mirrored_image", "another");
  planted.change_sample = [&](Sample& sample) {
    if (sample.camera != 3) return;
    if (mistake == "mirrored_image") sample.mask = mirrored(sample.mask);
    if (mistake == "another") sample.mask = cropped(sample.mask, 35, 20, sample.mask.width, sample.mask.height);
  };
  const Diagnosis diagnosis = diagnosis_of(planted);
  CAPTURE(mistake, diagnosis.suspected, diagnosis.sentences);
  REQUIRE(diagnosis.sentences.size() == 1);
  CHECK_THAT(diagnosis.sentences[0], Contains("cam03"));
  if (mistake == "mirrored_image") CHECK(diagnosis.suspected == std::vector<std::string>{"cam03:mirrored_image"});
  if (mistake == "another") CHECK_THAT(diagnosis.sentences[0], Contains("no known mistake explains it"));
}

TEST_CASE("a body that is somewhere else is said to be, where no known mistake explains it") {
  ChangedCapture planted(open_it());
  planted.change_pose = [](int, Pose& pose) { pose.translation += Eigen::Vector3d(0.35, 0.3, 0.2); };
  const Diagnosis diagnosis = diagnosis_of(planted);
  CAPTURE(diagnosis.mask_iou, diagnosis.suspected, diagnosis.sentences);
  REQUIRE_FALSE(diagnosis.sentences.empty());
  CHECK_THAT(diagnosis.sentences.back(), Contains("the body covers the person poorly"));
}
