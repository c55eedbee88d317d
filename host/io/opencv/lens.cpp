#include "host/io/lens.h"

#include <opencv2/calib3d.hpp>

namespace degas {

Image8 undistorted(const Image8& image, const Lens& lens) {
  if (!lens.distorts()) return image;
  Image8 out = Image8::black(image.width, image.height, image.channels);
  const cv::Mat source(image.height, image.width, CV_8UC(image.channels), const_cast<uint8_t*>(image.pixels.data()));
  cv::Mat target(image.height, image.width, CV_8UC(image.channels), out.pixels.data());
  // OpenCV's pixel centres are whole numbers, ours lie at +0.5.
  const Camera& camera = lens.camera;
  const cv::Matx33d intrinsics(camera.fx, 0, camera.cx - 0.5, 0, camera.fy, camera.cy - 0.5, 0, 0, 1);
  cv::undistort(source, target, intrinsics, lens.distortion);
  return out;
}

}  // namespace degas
