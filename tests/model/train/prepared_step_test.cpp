#include "model/train/prepared_step.h"

#include <cmath>

#include "model/train/boxes.h"
#include "tests/support/test_devices.h"
#include "tests/support/training_scene.h"

using namespace degas;
using namespace degas::test;

namespace {

/// A preparer over the synthetic scene with everything it looks at.
struct Scene {
  explicit Scene(const Config& config)
      : config(config),
        capture(open_scene()),
        avatar(device(KernelSet::Wide), config, BodyModel::load(training_scene() / "body.npz"), capture->betas(),
               capture->face_code_size()),
        views(*capture, config.data),
        codes(*capture, allowed_cameras(*capture, config.data), config.face,
              [](int, const Camera& camera) { return camera.fx; }),
        preparer(this->config, *capture, avatar, views, codes) {}

  PreparedStep prepare(int64_t step) {
    const LoadRequest request{2, {1, 2}};
    return preparer.prepare(step, request, {capture->load(2, 1), capture->load(2, 2)});
  }

  Config config;
  std::unique_ptr<Capture> capture;
  Avatar avatar;
  TrainingViews views;
  FaceCodes codes;
  StepPreparer preparer;
};

double distance(const std::vector<float>& a, const std::vector<float>& b) {
  double square = 0;
  for (size_t i = 0; i < a.size(); ++i) square += std::pow(static_cast<double>(a[i]) - b[i], 2);
  return std::sqrt(square / static_cast<double>(a.size()));
}

}  // namespace

TEST_CASE("a step is prepared to the same bits whenever it is asked for, and backgrounds vary") {
  Config config = tiny_config();
  config.train.pose_jitter = 0.01;
  config.train.code_jitter = 0.1;
  Scene scene(config);
  const PreparedStep first = scene.prepare(5);
  scene.prepare(6);
  const PreparedStep again = scene.prepare(5);
  CHECK(first.signal.face_code == again.signal.face_code);
  CHECK(first.signal.joint_angles == again.signal.joint_angles);
  CHECK(first.signal.posed_vertex_map == again.signal.posed_vertex_map);
  CHECK(first.pictures[1].background == again.pictures[1].background);
  CHECK(first.pictures[0].background != first.pictures[1].background);
}

TEST_CASE("jitter reaches what the network sees, in its size, and not what poses the Gaussians") {
  Config config = tiny_config();
  Scene plain(config);
  config.train.pose_jitter = 0.02;
  config.train.code_jitter = 0.3;
  Scene noisy(config);
  const PreparedStep a = plain.prepare(3), b = noisy.prepare(3);
  CHECK(distance(a.signal.joint_angles, b.signal.joint_angles) == Approx(0.02).epsilon(0.2));
  const std::vector<float> zero(a.signal.face_code.size());
  CHECK(distance(a.signal.face_code, b.signal.face_code) ==
        Approx(0.3 * distance(a.signal.face_code, zero)).epsilon(0.2));
  CHECK(a.signal.posed_vertex_map != b.signal.posed_vertex_map);
  for (size_t joint = 0; joint < a.signal.pose.axis_angles.size(); ++joint) {
    CHECK(a.signal.pose.axis_angles[joint] == b.signal.pose.axis_angles[joint]);
  }
}

TEST_CASE("the perceptual loss is told its region, in pixels of the window") {
  Config config = tiny_config();
  config.data.crop_to_person = true;
  config.loss.lpips_weight = 0.1;
  for (const LossRegion region : {LossRegion::Full, LossRegion::Person, LossRegion::Face}) {
    config.loss.lpips_region = region;
    Scene scene(config);
    const TrainingPicture picture = scene.prepare(0).pictures[0];
    CHECK(picture.region.has_value() == (region != LossRegion::Full));
    if (region == LossRegion::Person) {
      const Rectangle person = mask_box(picture.mask);
      CHECK((picture.region->left == person.left && picture.region->height == person.height));
    }
    if (region == LossRegion::Face) {
      const auto face = face_box(scene.avatar.body(), scene.capture->pose(2), scene.avatar.betas(), picture.view);
      REQUIRE(face);
      CHECK((picture.region->left == face->left && picture.region->width == face->width));
    }
  }
}
