#include <png.h>

#include <algorithm>
#include <cmath>

#include "host/io/image.h"
#include "host/io/without_opencv/lacks_opencv.h"

namespace degas {
namespace {

/// Of a PNG file: deflate makes at most 1032 bytes of one, and a byte holds at most eight pixels.
constexpr uint64_t most_pixels_a_byte = 8 * 1032;
constexpr uint64_t most_pixels = uint64_t{1} << 28;

/// How much a pixel of a row counts in one of the resized row.
struct Share {
  int from, to;
  double weight;
};

/// Each pixel of the resized row is the mean of a window about its centre: what it covers, or, where `smooth`, as much
/// as one pixel, which is linear interpolation between pixel centres.
std::vector<Share> window_shares(int size, int resized_size, bool smooth) {
  std::vector<Share> shares;
  const double step = static_cast<double>(size) / resized_size, window = smooth ? 1 : step;
  for (int to = 0; to < resized_size; ++to) {
    const double begin = (to + 0.5) * step - window / 2, end = begin + window;
    for (int from = static_cast<int>(std::floor(begin)); from < end; ++from) {
      const double overlap = std::min(from + 1.0, end) - std::max<double>(from, begin);
      if (overlap > 0) shares.push_back({std::clamp(from, 0, size - 1), to, overlap / window});
    }
  }
  return shares;
}

/// An image as libpng's simplified interface names it; `format` of PNG_FORMAT_*.
png_image described(uint32_t width, uint32_t height, uint32_t format) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = width;
  image.height = height;
  image.format = format;
  return image;
}

}  // namespace

Image8 decode_image(std::span<const std::byte> bytes, int channels, const std::string& label) {
  if (channels != 1 && channels != 3) throw std::logic_error("[image] 1 or 3 channels can be read");
  const auto* data = reinterpret_cast<png_const_bytep>(bytes.data());
  if (bytes.size() < 8 || png_sig_cmp(data, 0, 8) != 0) {
    lacks_opencv(label + ": pictures other than PNG cannot be read");
  }
  png_image file = described(0, 0, 0);
  const Error damaged = Error::format("{}: is no picture that can be decoded; the PNG file is damaged", label);
  if (!png_image_begin_read_from_memory(&file, data, bytes.size())) throw damaged;
  const uint64_t pixels = uint64_t{file.width} * file.height;
  if (pixels > most_pixels_a_byte * bytes.size() || pixels > most_pixels) {
    png_image_free(&file);
    throw damaged;
  }
  // Colours of grey pictures, grey of coloured ones and no alpha, as OpenCV reads them; but libpng heeds a gAMA chunk,
  // which OpenCV does not.
  const bool colored = channels == 3 || (file.format & PNG_FORMAT_FLAG_COLOR) != 0;
  file.format = (colored ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY) | (file.format & PNG_FORMAT_FLAG_ALPHA);
  file.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;
  const int width = static_cast<int>(file.width), height = static_cast<int>(file.height);
  const Image8 stored = [&] {
    Image8 image = Image8::black(width, height, static_cast<int>(PNG_IMAGE_SAMPLE_CHANNELS(file.format)));
    if (!png_image_finish_read(&file, nullptr, image.pixels.data(), 0, nullptr)) throw damaged;
    return image;
  }();
  Image8 out = Image8::black(width, height, channels);
  for (size_t i = 0; i < out.pixels.size() / static_cast<size_t>(channels); ++i) {
    const uint8_t* from = stored.pixels.data() + i * static_cast<size_t>(stored.channels);
    uint8_t* to = out.pixels.data() + i * static_cast<size_t>(channels);
    if (channels == 1 && colored) {
      *to = static_cast<uint8_t>((299 * from[0] + 587 * from[1] + 114 * from[2] + 500) / 1000);
    } else {
      std::copy_n(from, channels, to);
    }
  }
  return out;
}

std::vector<std::byte> encode_image(const Image8& image, const std::string& extension) {
  if (extension == ".jpg") lacks_opencv("pictures cannot be written as '.jpg'");
  if (extension != ".png") throw Error::format("pictures cannot be written as '{}': use .png", extension);
  png_image file = described(static_cast<uint32_t>(image.width), static_cast<uint32_t>(image.height),
                             image.channels == 1   ? PNG_FORMAT_GRAY
                             : image.channels == 3 ? PNG_FORMAT_RGB
                                                   : PNG_FORMAT_RGBA);
  size_t size = PNG_IMAGE_PNG_SIZE_MAX(file);
  std::vector<std::byte> bytes(size);
  if (!png_image_write_to_memory(&file, bytes.data(), &size, 0, image.pixels.data(), 0, nullptr)) {
    throw Error::format("a picture cannot be written as '{}': {}", extension, file.message);
  }
  bytes.resize(size);
  return bytes;
}

Image8 resized(const Image8& image, int width, int height) {
  if (width == image.width && height == image.height) return image;
  const bool smooth = width > image.width || height > image.height;
  const size_t channels = static_cast<size_t>(image.channels);
  const size_t row = static_cast<size_t>(image.width) * channels, resized_row = static_cast<size_t>(width) * channels;
  std::vector<double> rows(static_cast<size_t>(height) * row);  // of the new height, as wide as before
  for (const Share& share : window_shares(image.height, height, smooth)) {
    const uint8_t* from = image.at(0, share.from);
    double* to = rows.data() + static_cast<size_t>(share.to) * row;
    for (size_t i = 0; i < row; ++i) to[i] += share.weight * from[i];
  }
  const std::vector<Share> columns = window_shares(image.width, width, smooth);
  Image8 out = Image8::black(width, height, image.channels);
  std::vector<double> sums(resized_row);
  for (int y = 0; y < height; ++y) {
    std::fill(sums.begin(), sums.end(), 0.0);
    const double* from = rows.data() + static_cast<size_t>(y) * row;
    for (const Share& share : columns) {
      for (size_t c = 0; c < channels; ++c) {
        sums[static_cast<size_t>(share.to) * channels + c] +=
            share.weight * from[static_cast<size_t>(share.from) * channels + c];
      }
    }
    for (size_t i = 0; i < resized_row; ++i) out.at(0, y)[i] = static_cast<uint8_t>(std::lround(sums[i]));
  }
  return out;
}

}  // namespace degas
