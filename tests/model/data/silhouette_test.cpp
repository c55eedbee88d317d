#include <algorithm>
#include <array>

#include "model/body/body_model.h"
#include "model/data/dreams_capture.h"
#include "tests/support/test_devices.h"

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

double overlap(const BodyModel& body, const std::vector<Vector3d>& vertices, const Sample& sample) {
  std::vector<char> mask(static_cast<size_t>(sample.view.width) * sample.view.height, 0);
  for (const std::array<int, 3>& face : body.faces()) {
    std::array<Vector2d, 3> corners;
    for (int k = 0; k < 3; ++k) corners[k] = sample.view.project(vertices[face[k]]).head<2>();
    fill(corners, sample.view, mask);
  }
  double both = 0, either = 0;
  for (size_t i = 0; i < mask.size(); ++i) {
    const bool person = sample.mask.pixels[i] >= 128;
    both += person && mask[i];
    either += person || mask[i];
  }
  return both / either;
}

}  // namespace

// The body wears neither clothes nor hair, so that about 0.87 is all one can have.
TEST_CASE("a posed body covers the person in the pictures of a full-size capture") {
  const std::string path = data_path("data/capture/A/P1C1"), body_path = data_path("data/bodies/male.npz");
  if (path.empty() || body_path.empty()) return;
  const DreamsCapture capture(path, {});
  const BodyModel body = BodyModel::load(body_path);
  double sum = 0;
  int count = 0;
  for (const int frame : {3, 41, 70}) {
    Pose pose = capture.pose(frame);
    if (!capture.flat_hand_mean()) pose = body.with_hand_mean(pose);
    const std::vector<Vector3d> vertices = body.posed_vertices(pose, capture.betas(), true);
    for (const int camera : {0, 4, 9}) {
      if (!capture.has_image(frame, camera)) continue;
      const double found = overlap(body, vertices, capture.load(frame, camera));
      CAPTURE(frame, camera);
      CHECK(found > 0.75);
      sum += found;
      ++count;
    }
  }
  REQUIRE(count == 9);
  CHECK(sum / count > 0.84);
}
