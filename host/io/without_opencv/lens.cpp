#include "host/io/lens.h"

#include "host/io/without_opencv/lacks_opencv.h"

namespace degas {

Image8 undistorted(const Image8& image, const Lens& lens) {
  if (!lens.distorts()) return image;
  lacks_opencv("pictures of a camera with distortion cannot be undistorted");
}

}  // namespace degas
