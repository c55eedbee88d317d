#include "model/faces/face_boxes.h"

#include <algorithm>

#include "model/train/boxes.h"
#include "tests/support/catch.h"
#include "tests/support/training_scene.h"

using namespace degas;
using namespace degas::test;

namespace {

bool same(const Rectangle& a, const Rectangle& b) {
  return a.left == b.left && a.top == b.top && a.width == b.width && a.height == b.height;
}

}  // namespace

TEST_CASE("a square stays around all boxes of its camera") {
  const FaceCrops crops({{0, 1, {10, 20, 8, 6}, 0.1}, {3, 1, {30, 10, 4, 10}, 0.1}, {0, 2, {5, 5, 3, 3}, 0.3}}, {50});
  // Together: x 10 .. 34, y 10 .. 26, so 24 on a side around (22, 18), then 50 more on each.
  REQUIRE(crops.of_frame(0).size() == 2);
  CHECK(same(crops.of_frame(0)[0].box, {-40, -44, 124, 124}));
  CHECK(same(crops.of_frame(3).at(0).box, {-40, -44, 124, 124}));
  CHECK(same(crops.of_frame(0)[1].box, {-45, -45, 103, 103}));
  CHECK(crops.of_frame(2).empty());
}

TEST_CASE("a square that tracks keeps its size and follows") {
  const FaceCrops crops({{0, 1, {10, 20, 8, 6}, 0.1}, {3, 1, {30, 10, 4, 10}, 0.1}}, {5, true});
  CHECK(same(crops.of_frame(0).at(0).box, {4, 13, 20, 20}));
  CHECK(same(crops.of_frame(3).at(0).box, {22, 5, 20, 20}));
}

TEST_CASE("what a detector takes for a face now and then is left out; a face that walks through the picture is not") {
  std::vector<FaceBox> faces;
  for (int frame = 0; frame < 40; ++frame) {
    faces.push_back({frame, 0, {100 + 6 * frame, 50 + frame % 3, 20, 20}, -1});
    faces.push_back({frame, 1, {30, 40, 24, 24}, -1});
  }
  std::vector<FaceBox> found = faces;
  found[2 * 7].box = {120, 300, 20, 20};     // a shoe
  found[2 * 20 + 1].box = {0, 0, 120, 120};  // the whole person
  found[2 * 39 + 1].box = {40, 50, 9, 9};    // a badge
  const std::vector<FaceBox> kept = without_strays(found);
  CHECK(kept.size() == faces.size() - 3);
  for (const FaceBox& face : kept) {
    CHECK(face.box.width == (face.camera == 0 ? 20 : 24));
    CHECK(face.box.top < 60);
  }
  CHECK(without_strays(faces).size() == faces.size());
  CHECK(without_strays({}).empty());
}

TEST_CASE("a frame's most frontal face comes first, of equal ones the first camera's") {
  const FaceCrops crops({{0, 3, {0, 0, 2, 2}, 0.5}, {0, 1, {0, 0, 2, 2}, 0.5}, {0, 2, {0, 0, 2, 2}, 0.2}}, {});
  std::vector<int> cameras;
  for (const FaceBox& face : crops.of_frame(0)) cameras.push_back(face.camera);
  CHECK(cameras == std::vector<int>{2, 1, 3});
}

TEST_CASE("the body's head is found in every view within the angle, and in no camera that is not asked") {
  const auto capture = open_scene();
  const BodyModel body = BodyModel::load(training_scene() / "body.npz");
  const std::vector<FaceBox> all = projected_faces(*capture, body, {0, 1, 3, 4}, 3.2);
  const std::vector<FaceBox> frontal = projected_faces(*capture, body, {0, 1, 3, 4}, 1.2);
  CHECK(all.size() == static_cast<size_t>(4 * capture->frame_count()));
  CHECK(frontal.size() < all.size());
  CHECK_FALSE(frontal.empty());
  for (const FaceBox& face : all) {
    CHECK(face.camera != 2);
    const auto box = head_box(body, capture->pose(face.frame), capture->betas(), capture->camera(face.camera));
    REQUIRE(box);
    CHECK(same(face.box, *box));
    const bool is_frontal = std::any_of(frontal.begin(), frontal.end(), [&](const FaceBox& other) {
      return other.frame == face.frame && other.camera == face.camera;
    });
    CHECK(is_frontal == (face.rank <= 1.2));
  }
}
