#include "model/train/prepared_step.h"

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

}  // namespace

TEST_CASE("a step is prepared to the same bits whenever it is asked for, and backgrounds vary") {
  Scene scene(tiny_config());
  const PreparedStep first = scene.prepare(5);
  scene.prepare(6);
  const PreparedStep again = scene.prepare(5);
  CHECK(first.signal.face_code == again.signal.face_code);
  CHECK(first.signal.joint_angles == again.signal.joint_angles);
  CHECK(first.signal.posed_vertex_map == again.signal.posed_vertex_map);
  CHECK(first.pictures[1].background == again.pictures[1].background);
  CHECK(first.pictures[0].background != first.pictures[1].background);
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
