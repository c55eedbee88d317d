#include "host/io/face_detector.h"

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/objdetect.hpp>

#include "host/error.h"
#include "host/io/opencv/opencv_image.h"

namespace degas {
namespace fs = std::filesystem;
namespace {

constexpr int smallest_face = 24;  // pixels: what the cascades were trained on
constexpr double scale_step = 1.1;
constexpr int least_neighbors = 4;

}  // namespace

struct FaceDetector::Detector {
  cv::CascadeClassifier cascade;
  cv::Ptr<cv::FaceDetectorYN> network;  // null for a cascade
};

FaceDetector::FaceDetector(const fs::path& path) : detector_(std::make_unique<Detector>()) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  if (!fs::is_regular_file(path)) throw Error::format("{}: no such file", path.string());
  bool loaded = false;
  try {
    if (path.extension() == ".onnx") {
      const cv::Size size(320, 320);
      detector_->network = cv::FaceDetectorYN::create(path.string(), "", size);
      cv::Mat faces;  // none, but a network without a face detector's outputs fails only here
      detector_->network->detect(cv::Mat::zeros(size, CV_8UC3), faces);
      loaded = true;
    } else {
      loaded = detector_->cascade.load(path.string());
    }
  } catch (const cv::Exception&) {
    loaded = false;  // told below
  }
  if (!loaded) {
    throw Error::format("{}: is no face detector that OpenCV {} reads; a Haar cascade (.xml) or YuNet (.onnx) is",
                        path.string(), CV_VERSION);
  }
}

FaceDetector::~FaceDetector() = default;

std::optional<DetectedFace> FaceDetector::find(const Image8& picture) {
  std::optional<DetectedFace> best;
  const auto offer = [&](const Rectangle& box, double score) {
    if (!best || score > best->score) best = {box, score};
  };
  const cv::Mat image = matrix_of(picture);
  if (detector_->network) {
    cv::Mat faces;  // a row each: x, y, width, height, five landmarks, score
    detector_->network->setInputSize(image.size());
    detector_->network->detect(image, faces);
    for (int row = 0; row < faces.rows; ++row) {
      const float* face = faces.ptr<float>(row);
      const auto whole = [](float value) { return static_cast<int>(std::lround(value)); };
      offer({whole(face[0]), whole(face[1]), whole(face[2]), whole(face[3])}, face[14]);
    }
    return best;
  }
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  std::vector<cv::Rect> boxes;
  std::vector<int> levels;
  std::vector<double> weights;
  detector_->cascade.detectMultiScale(grey, boxes, levels, weights, scale_step, least_neighbors, 0,
                                      {smallest_face, smallest_face}, {}, true);
  for (size_t i = 0; i < boxes.size(); ++i) {
    offer({boxes[i].x, boxes[i].y, boxes[i].width, boxes[i].height}, weights[i]);
  }
  return best;
}

fs::path FaceDetector::installed() {
  for (const char* folder : {"/usr/share/opencv4/haarcascades", "/usr/local/share/opencv4/haarcascades"}) {
    const fs::path path = fs::path(folder) / "haarcascade_frontalface_default.xml";
    if (fs::exists(path)) return path;
  }
  throw Error(
      "no face detector is installed; install one (Debian: opencv-data), name a file by --detector, or give a "
      "--body, whose projected head needs none");
}

}  // namespace degas
