#pragma once

#include <vector>

#include "host/io/image.h"
#include "host/ops/camera.h"

namespace degas {

/// A camera as a calibration gives it: a pinhole and OpenCV's distortion of the picture that it makes.
struct Lens {
  Camera camera;                   ///< of the picture without distortion, at full size
  std::vector<double> distortion;  ///< OpenCV's k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 .. s4 [tx ty]]]]; empty: none

  bool distorts() const;
};

/// Is this a number of coefficients that OpenCV's model has?
bool is_distortion_size(size_t count);

/// The picture that `lens.camera` sees, bilinearly; 0 where the distorted picture does not reach. A picture without
/// distortion comes back as it is.
Image8 undistorted(const Image8& image, const Lens& lens);

}  // namespace degas
