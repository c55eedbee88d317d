#pragma once

// For .cpp files of host/io and model/data only: the one place where OpenCV's BGR meets our RGB.

#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "host/io/image.h"

namespace degas {

/// A copy in OpenCV's order of channels.
inline cv::Mat matrix_of(const Image8& image) {
  const cv::Mat view(image.height, image.width, CV_8UC(image.channels), const_cast<uint8_t*>(image.pixels.data()));
  cv::Mat matrix;
  switch (image.channels) {
    case 1:
      return view.clone();
    case 3:
      cv::cvtColor(view, matrix, cv::COLOR_RGB2BGR);
      return matrix;
    case 4:
      cv::cvtColor(view, matrix, cv::COLOR_RGBA2BGRA);
      return matrix;
  }
  throw std::logic_error("[image] a picture has 1, 3 or 4 channels");
}

/// A copy of an 8-bit BGR or grey matrix.
inline Image8 image_of(const cv::Mat& matrix) {
  Image8 image = Image8::black(matrix.cols, matrix.rows, matrix.channels());
  cv::Mat view(image.height, image.width, CV_8UC(image.channels), image.pixels.data());
  if (image.channels == 3) {
    cv::cvtColor(matrix, view, cv::COLOR_BGR2RGB);
  } else {
    matrix.copyTo(view);
  }
  return image;
}

}  // namespace degas
