#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "host/io/image.h"
#include "host/ops/image.h"

namespace degas {

/// A face in a picture.
struct DetectedFace {
  Rectangle box;
  double score = 0;  ///< higher is surer; comparable between pictures of one detector
};

/// Finds faces by one of OpenCV's detectors. One thread at a time.
class FaceDetector {
 public:
  /// A Haar cascade (.xml) or a YuNet network (.onnx). Error naming the file when it is missing or neither.
  explicit FaceDetector(const std::filesystem::path& path);
  ~FaceDetector();

  /// The surest face of an RGB picture.
  std::optional<DetectedFace> find(const Image8& picture);

  /// The cascade for frontal faces that Debian's opencv-data installs. Error telling the remedy when there is none.
  static std::filesystem::path installed();

 private:
  struct Detector;
  std::unique_ptr<Detector> detector_;
};

}  // namespace degas
