// Faces of real people: what the detector finds in four cameras is one head, where the recording's calibration has it.

#include <Eigen/Dense>
#include <map>

#include "model/faces/face_boxes.h"
#include "tests/support/real_recording.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

Eigen::Vector2d middle_of(const Rectangle& box) {
  return {box.left + box.width / 2.0, box.top + box.height / 2.0};
}

/// The point that lies nearest to the rays through the boxes' middles.
Eigen::Vector3d meeting_point(const Capture& capture, const std::vector<FaceBox>& faces) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const FaceBox& face : faces) {
    const Camera view = capture.camera(face.camera);
    const Eigen::Vector2d pixel = middle_of(face.box);
    const Eigen::Vector3d direction((pixel.x() - view.cx) / view.fx, (pixel.y() - view.cy) / view.fy, 1);
    const Eigen::Vector3d ray = (view.rotation.transpose() * direction).normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    sum += across;
    right += across * view.center();
  }
  return sum.ldlt().solve(right);
}

}  // namespace

TEST_CASE("the faces found in a real recording's cameras are one head in space") {
  const std::string recording = data_path("data/real/caliscope_4cam");
  if (recording.empty()) return;
  const TemporaryFolder folder;
  write_caliscope_capture(recording, folder.path(), 4, {0, 30, 60, 75, 105});
  CaptureOptions options;
  options.incomplete = true;
  options.warn = [](const std::string&) {};
  const auto capture = open_uncached_capture(folder.path(), options);
  FaceDetector detector(FaceDetector::installed());
  const auto faces = detected_faces(*capture, detector, {0, 1, 2, 3}, [](int, int) { return true; });
  REQUIRE(faces);
  std::map<int, std::vector<FaceBox>> by_frame;
  for (const FaceBox& face : *faces) by_frame[face.frame].push_back(face);
  CHECK(by_frame.size() == 5);
  for (const auto& [frame, seen] : by_frame) {
    CHECK(seen.size() >= 2);
    const Eigen::Vector3d head = meeting_point(*capture, seen);
    for (const FaceBox& face : seen) {
      const Camera view = capture->camera(face.camera);
      CAPTURE(frame, face.camera, face.box.left, face.box.top, face.box.width);
      const Eigen::Vector3d at = view.rotation * head + view.translation;
      CHECK(at.z() > 0.5);  // metres
      CHECK(at.z() < 1.5);
      const Eigen::Vector2d pixel(view.fx * at.x() / at.z() + view.cx, view.fy * at.y() / at.z() + view.cy);
      CHECK((pixel - middle_of(face.box)).norm() < 0.15 * face.box.width);
    }
  }
}
