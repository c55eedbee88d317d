#include "host/io/image.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/opencv_image.h"

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

Image8 read_image(const std::filesystem::path& path, int channels) {
  return decode_image(read_file_bytes(path), channels, path.string());
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

void write_image(const std::filesystem::path& path, const Image8& image) {
  write_file_atomically(path, encode_image(image, path.extension().string()));
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

Image8 cropped(const Image8& image, int left, int top, int width, int height) {
  Image8 out = Image8::black(width, height, image.channels);
  const int begin = std::max(0, -left), end = std::min(width, image.width - left);
  for (int y = std::max(0, -top); y < std::min(height, image.height - top) && begin < end; ++y) {
    std::copy_n(image.at(left + begin, top + y), static_cast<size_t>(end - begin) * image.channels, out.at(begin, y));
  }
  return out;
}

}  // namespace degas
