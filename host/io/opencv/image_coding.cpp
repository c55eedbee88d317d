#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "host/error.h"
#include "host/io/image.h"
#include "host/io/opencv/opencv_image.h"

namespace degas {

Image8 decode_image(std::span<const std::byte> bytes, int channels, const std::string& label) {
  if (channels != 1 && channels != 3) throw std::logic_error("[image] 1 or 3 channels can be read");
  cv::Mat decoded;
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<std::byte*>(bytes.data()));
    if (!bytes.empty()) decoded = cv::imdecode(buffer, channels == 1 ? cv::IMREAD_GRAYSCALE : cv::IMREAD_COLOR);
  } catch (const cv::Exception&) {
    decoded.release();  // told below
  }
  if (decoded.empty()) throw Error::format("{}: is no picture that can be decoded (PNG and JPEG are)", label);
  return image_of(decoded);
}

std::vector<std::byte> encode_image(const Image8& image, const std::string& extension) {
  std::vector<uchar> encoded;
  try {
    const std::vector<int> parameters = extension == ".png" ? std::vector<int>{cv::IMWRITE_PNG_COMPRESSION, 3}
                                                            : std::vector<int>{cv::IMWRITE_JPEG_QUALITY, 95};
    if (!cv::imencode(extension, matrix_of(image), encoded, parameters)) encoded.clear();
  } catch (const cv::Exception&) {
    encoded.clear();
  }
  if (encoded.empty()) throw Error::format("pictures cannot be written as '{}': use .png or .jpg", extension);
  const auto bytes = std::as_bytes(std::span<const uchar>(encoded));
  return {bytes.begin(), bytes.end()};
}

Image8 resized(const Image8& image, int width, int height) {
  if (width == image.width && height == image.height) return image;
  Image8 out = Image8::black(width, height, image.channels);
  const bool shrinks = width <= image.width && height <= image.height;
  cv::Mat target(height, width, CV_8UC(image.channels), out.pixels.data());
  const cv::Mat source(image.height, image.width, CV_8UC(image.channels), const_cast<uint8_t*>(image.pixels.data()));
  cv::resize(source, target, target.size(), 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
  return out;
}

}  // namespace degas
