#include "model/data/selected_capture.h"

#include "tests/support/catch.h"
#include "tests/support/training_scene.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("a part of a capture answers as the whole does for these frames and cameras") {
  const auto whole = open_scene();
  const std::vector<int> frames = {4, 1, 2}, cameras = {3, 0};
  const auto part = selected(open_scene(), frames, cameras);
  REQUIRE(part->frame_count() == 3);
  CHECK(part->camera_names() == std::vector<std::string>{"cam03", "cam00"});
  CHECK(part->betas() == whole->betas());
  for (int frame = 0; frame < 3; ++frame) {
    const int row = frames[static_cast<size_t>(frame)];
    CHECK(part->frame_number(frame) == whole->frame_number(row));
    CHECK(part->pose(frame).axis_angles == whole->pose(row).axis_angles);
    for (int camera = 0; camera < 2; ++camera) {
      const int index = cameras[static_cast<size_t>(camera)];
      CHECK(part->camera(camera).fx == whole->camera(index).fx);
      CHECK(part->camera(camera).translation == whole->camera(index).translation);
      CHECK(part->has_face_code(frame, camera) == whole->has_face_code(row, index));
      CHECK(part->face_code(frame, camera) == whole->face_code(row, index));
      REQUIRE(part->has_image(frame, camera));
      const Sample got = part->load(frame, camera), expected = whole->load(row, index);
      CHECK(got.image.pixels == expected.image.pixels);
      CHECK(got.mask.pixels == expected.mask.pixels);
      CHECK(got.frame == frame);
      CHECK(got.camera == camera);
    }
  }
}

TEST_CASE("another part has another identity; all in their order are the capture itself") {
  const auto whole = open_scene();
  const std::vector<int> frames = {0, 1, 2, 3, 4, 5}, cameras = {0, 1, 2, 3, 4};
  CHECK(selected(open_scene(), frames, cameras)->identity() == whole->identity());
  const auto turned = selected(open_scene(), frames, {0, 1, 2, 4, 3}), fewer = selected(open_scene(), {0, 1}, cameras);
  CHECK(turned->identity() != whole->identity());
  CHECK(turned->picture_identity() != whole->picture_identity());
  CHECK(fewer->identity() != whole->identity());
  CHECK(fewer->identity() != turned->identity());
}
