#pragma once

#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "host/io/face_detector.h"
#include "model/body/body_model.h"
#include "model/data/capture.h"

namespace degas {

/// A face in a picture of a capture.
struct FaceBox {
  int frame = 0, camera = 0;
  Rectangle box;    ///< pixels of the picture as the capture delivers it
  double rank = 0;  ///< the lowest of a frame is the most frontal
};

/// The body model's head projected into all frames of these cameras (head_box), ranked by frontal_angle; views from
/// more than `max_angle` radians off the front are left out, and those whose picture does not show the head.
std::vector<FaceBox> projected_faces(const Capture& capture, const BodyModel& body, const std::vector<int>& cameras,
                                     double max_angle);

/// Without the boxes that are no face of this camera's: more than one and a half times its size away from where the ten
/// detections around it have theirs, or of half or double their size. A detector takes a shoe or a shadow for a face
/// now and then, and a square around all boxes would reach there.
std::vector<FaceBox> without_strays(const std::vector<FaceBox>& faces);

/// The surest face of each picture of these cameras, ranked by the detector's score, without strays. `go_on` is told of
/// pictures done and in all; when it returns false, nothing is returned.
std::optional<std::vector<FaceBox>> detected_faces(const Capture& capture, FaceDetector& detector,
                                                   const std::vector<int>& cameras,
                                                   const std::function<bool(int done, int total)>& go_on);

/// How squares are cut around boxes.
struct CropOptions {
  int margin = 50;     ///< pixels that a box grows by on every side
  bool track = false;  ///< the square follows the head at one size; otherwise it stays where it is all the sequence
};

/// The squares that are encoded: from each frame's most frontal faces, in that order. Squares are of one size a camera,
/// and may reach over the picture's border: around all boxes of the camera, or, to track, around each box and as large
/// as the camera's largest needs.
class FaceCrops {
 public:
  FaceCrops(const std::vector<FaceBox>& faces, const CropOptions& options);
  /// Faces of a frame with their squares instead of boxes, the most frontal first.
  const std::vector<FaceBox>& of_frame(int frame) const;

 private:
  std::map<int, std::vector<FaceBox>> by_frame_;
};

}  // namespace degas
