#include "host/io/face_detector.h"

#include "host/io/without_opencv/lacks_opencv.h"

namespace degas {

struct FaceDetector::Detector {};

FaceDetector::FaceDetector(const std::filesystem::path& path) {
  lacks_opencv(path.string() + ": faces cannot be detected");
}
FaceDetector::~FaceDetector() = default;
std::optional<DetectedFace> FaceDetector::find(const Image8&) {
  return {};
}
std::filesystem::path FaceDetector::installed() {
  lacks_opencv("faces cannot be detected, give a --body, whose projected head needs no detector");
}

}  // namespace degas
