#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace degas {

/// An 8-bit picture: rows from the top, channels interleaved (RGB, RGBA or one of grey), no padding.
struct Image8 {
  int width = 0, height = 0, channels = 0;
  std::vector<uint8_t> pixels;

  /// A picture of zeros.
  static Image8 black(int width, int height, int channels) {
    const size_t size = static_cast<size_t>(width) * static_cast<size_t>(height) * static_cast<size_t>(channels);
    return {width, height, channels, std::vector<uint8_t>(size)};
  }
  bool empty() const { return pixels.empty(); }
  uint8_t* at(int x, int y) { return pixels.data() + (static_cast<size_t>(y) * width + x) * channels; }
  const uint8_t* at(int x, int y) const { return pixels.data() + (static_cast<size_t>(y) * width + x) * channels; }
};

/// Reads PNG, JPEG and what else OpenCV knows, as `channels` 1 (grey) or 3 (RGB). Error naming the file.
Image8 read_image(const std::filesystem::path& path, int channels = 3);
/// Writes by the extension (.png lossless, .jpg at quality 95) under a temporary name, then renames. Error naming the
/// file.
void write_image(const std::filesystem::path& path, const Image8& image);
/// The same bytes without a file, for instance to embed a picture in a report; `extension` is ".png" or ".jpg".
std::vector<std::byte> encode_image(const Image8& image, const std::string& extension);
/// The inverse of encode_image; `label` stands for the file in errors.
Image8 decode_image(std::span<const std::byte> bytes, int channels, const std::string& label);

/// Area averaging where the picture shrinks, bilinear where it grows.
Image8 resized(const Image8& image, int width, int height);
/// The rectangle that starts at pixel (left, top); what lies outside of the picture is 0.
Image8 cropped(const Image8& image, int left, int top, int width, int height);

}  // namespace degas
