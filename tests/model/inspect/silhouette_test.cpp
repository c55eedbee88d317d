#include "model/inspect/silhouette.h"

#include <algorithm>
#include <array>

#include "model/body/body_model.h"
#include "model/data/capture.h"
#include "tests/support/test_devices.h"
#include "tests/support/training_scene.h"

using namespace degas;
using namespace degas::test;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// Marks the pixels whose centres lie in a projected triangle.
void fill(const std::array<Vector2d, 3>& corners, const Camera& camera, std::vector<char>& mask) {
  const auto cross = [](const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); };
  const auto& [a, b, c] = corners;
  const double area = cross(b - a, c - a);
  const Vector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  for (int y = std::max(0, static_cast<int>(low.y())); y < std::min<double>(camera.height, high.y()); ++y) {
    for (int x = std::max(0, static_cast<int>(low.x())); x < std::min<double>(camera.width, high.x()); ++x) {
      const Vector2d p(x + 0.5, y + 0.5);
      if (cross(b - a, p - a) * area >= 0 && cross(c - b, p - b) * area >= 0 && cross(a - c, p - c) * area >= 0) {
        mask[static_cast<size_t>(y) * camera.width + x] = 1;
      }
    }
  }
}

/// The silhouette by double loops over triangles and pixels.
Image8 filled(const BodyModel& body, const std::vector<Vector3d>& vertices, const Camera& camera) {
  std::vector<char> mask(static_cast<size_t>(camera.width) * camera.height, 0);
  for (const std::array<int, 3>& face : body.faces()) {
    std::array<Vector2d, 3> corners;
    for (int k = 0; k < 3; ++k) corners[k] = camera.project(vertices[face[k]]).head<2>();
    fill(corners, camera, mask);
  }
  Image8 picture = Image8::black(camera.width, camera.height, 1);
  for (size_t i = 0; i < mask.size(); ++i) picture.pixels[i] = mask[i] ? 255 : 0;
  return picture;
}

/// Pixels in which two pictures differ, as a part of those that are white in the first.
double difference(const Image8& a, const Image8& b) {
  double differ = 0, white = 0;
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    differ += a.pixels[i] != b.pixels[i];
    white += a.pixels[i] > 0;
  }
  return differ / white;
}

}  // namespace

TEST_CASE("overlap is intersection over union, in a box too") {
  Image8 a = Image8::black(6, 4, 1), b = a;
  CHECK(overlap(a, b) == 0);
  for (int x = 0; x < 4; ++x) *a.at(x, 1) = 255;
  for (int x = 2; x < 6; ++x) *b.at(x, 1) = 128;
  *b.at(0, 3) = 127;
  CHECK(overlap(a, b) == Approx(2.0 / 6));
  CHECK(overlap(a, b, Rectangle{2, 0, 3, 4}) == Approx(2.0 / 3));
  CHECK(overlap(a, b, Rectangle{-5, 0, 7, 9}) == 0);
  CHECK(overlap(a, a) == 1);
}

TEST_CASE("a silhouette is what double loops over triangles and pixels fill") {
  const std::unique_ptr<Capture> capture = open_scene();
  const BodyModel body = BodyModel::load(training_scene() / "body.npz");
  for (int camera = 0; camera < 5; ++camera) {
    const std::vector<Vector3d> vertices = body.posed_vertices(capture->pose(camera), capture->betas(), true);
    const BodySurface surface(vertices, body.faces());
    const Camera view = capture->camera(camera);
    CHECK(difference(filled(body, vertices, view), silhouette(surface, view)) < 0.005);
    // Half of the body outside of the picture, and a camera within it: nothing is drawn beyond the picture.
    const Camera part = view.cropped(view.width / 2, view.height / 2, 40, 30);
    CHECK(difference(filled(body, vertices, part), silhouette(surface, part)) < 0.01);
    Camera within = view;
    within.translation = -within.rotation * capture->pose(camera).translation;
    CHECK(silhouette(surface, within).pixels.size() == 64 * 80);
  }
}

TEST_CASE("the body is drawn half transparent within its silhouette, the mask's border in orange") {
  const std::unique_ptr<Capture> capture = open_scene();
  const BodyModel body = BodyModel::load(training_scene() / "body.npz");
  const BodySurface surface(body.posed_vertices(capture->pose(2), capture->betas(), true), body.faces());
  const Sample sample = capture->load(2, 1);
  const Image8 drawn = drawn_over(sample.image, sample.mask, surface, sample.view);
  const Image8 covered = silhouette(surface, sample.view);
  int orange = 0;
  for (size_t i = 0; i < covered.pixels.size(); ++i) {
    const uint8_t *before = &sample.image.pixels[3 * i], *after = &drawn.pixels[3 * i];
    if (after[0] == 255 && after[1] == 140 && after[2] == 0) {
      ++orange;
      CHECK(sample.mask.pixels[i] >= 128);
    } else if (covered.pixels[i] == 0) {
      CHECK(std::equal(before, before + 3, after));
    } else {
      CHECK(after[2] >= before[2] / 2);
    }
  }
  CHECK(orange > 40);
  CHECK(drawn_over(sample.image, {}, surface, sample.view).pixels.size() == drawn.pixels.size());
}

// The body wears neither clothes nor hair, so that about 0.87 is all one can have.
TEST_CASE("a posed body covers the person in the pictures of a full-size capture") {
  const std::string path = data_path("data/capture/A/P1C1"), body_path = data_path("data/bodies/male.npz");
  if (path.empty() || body_path.empty()) return;
  const std::unique_ptr<Capture> opened = open_uncached_capture(path);
  const Capture& capture = *opened;
  const BodyModel body = BodyModel::load(body_path);
  double sum = 0;
  int count = 0;
  for (const int frame : {3, 41, 70}) {
    const Pose pose = body.with_hands(capture.pose(frame), capture.flat_hand_mean());
    const std::vector<Vector3d> vertices = body.posed_vertices(pose, capture.betas(), true);
    for (const int camera : {0, 4, 9}) {
      if (!capture.has_image(frame, camera)) continue;
      const Sample sample = capture.load(frame, camera);
      const double found = overlap(silhouette(BodySurface(vertices, body.faces()), sample.view), sample.mask);
      CAPTURE(frame, camera);
      CHECK(found > 0.75);
      sum += found;
      ++count;
    }
  }
  REQUIRE(count == 9);
  CHECK(sum / count > 0.84);
}
