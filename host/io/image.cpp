#include "host/io/image.h"

#include <algorithm>

#include "host/io/file_bytes.h"

namespace degas {

Image8 read_image(const std::filesystem::path& path, int channels) {
  return decode_image(read_file_bytes(path), channels, path.string());
}

void write_image(const std::filesystem::path& path, const Image8& image) {
  write_file_atomically(path, encode_image(image, path.extension().string()));
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
