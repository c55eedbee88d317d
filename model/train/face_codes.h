#pragma once

#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "host/random.h"
#include "model/config.h"
#include "model/data/capture.h"

namespace degas {

/// Numbers in the face signal of a frame of `capture`; 0 where it has none, and for FaceSignal::None.
int face_code_size(const Capture& capture, FaceSignal signal);
/// The same for a network to be trained: Error where it wants codes that the capture does not have.
int required_face_code_size(const Capture& capture, const Config& config);

/// The face signal of each frame: the codes of its (up to) `frontal_views` most frontal cameras (method.md, "Driving
/// signals"). Training takes a random convex mixture of them, evaluation their mean; a frame with none gets zeros.
/// Codes are read when a frame is first asked for and kept. One thread at a time.
class FaceCodes {
 public:
  /// Radians between the direction the head faces in `frame` and the direction from the head to the camera.
  using FrontalAngle = std::function<double(int frame, const Camera& camera)>;

  /// cameras: those whose codes may be used; the held-out ones must not be among them.
  /// size: length of a code, and of the zeros where there is none; by default face_code_size.
  FaceCodes(const Capture& capture, std::vector<int> cameras, const FaceConfig& config, FrontalAngle frontal_angle,
            std::optional<int> size = {});

  /// Length of a code.
  int size() const { return size_; }
  std::vector<float> mixture(int frame, Random& random);
  std::vector<float> mean(int frame);
  /// Cameras whose codes serve this frame, the most frontal first.
  const std::vector<int>& cameras_of(int frame) { return codes_of(frame).cameras; }

 private:
  struct FrameCodes {
    std::vector<int> cameras;
    std::vector<std::vector<float>> codes;
  };
  const FrameCodes& codes_of(int frame);
  std::vector<float> combine(const FrameCodes& frame, const std::vector<double>& weights) const;

  const Capture& capture_;
  std::vector<int> cameras_;
  FaceConfig config_;
  FrontalAngle frontal_angle_;
  int size_;
  std::map<int, FrameCodes> kept_;
};

}  // namespace degas
