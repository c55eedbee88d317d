#include "model/data/person_pixels.h"

#include <cstdint>
#include <cstring>

namespace degas {
namespace {

void append(std::vector<std::byte>& bytes, uint16_t value) {
  bytes.push_back(static_cast<std::byte>(value & 255));
  bytes.push_back(static_cast<std::byte>(value >> 8));
}

}  // namespace

std::vector<std::byte> pack_person(const Image8& image, const Image8& mask) {
  std::vector<std::byte> bytes;
  for (int y = 0; y < mask.height; ++y) {
    const size_t count_at = bytes.size();
    uint16_t runs = 0;
    append(bytes, 0);
    for (int x = 0; x < mask.width;) {
      if (*mask.at(x, y) == 0) {
        ++x;
        continue;
      }
      int end = x;
      while (end < mask.width && *mask.at(end, y) != 0) ++end;
      append(bytes, static_cast<uint16_t>(x));
      append(bytes, static_cast<uint16_t>(end - x));
      const size_t pixels_at = bytes.size();
      bytes.resize(pixels_at + 4 * static_cast<size_t>(end - x));
      const uint8_t* colour = image.at(x, y);
      for (std::byte* pixel = bytes.data() + pixels_at; x < end; ++x, pixel += 4, colour += 3) {
        std::memcpy(pixel, colour, 3);
        pixel[3] = static_cast<std::byte>(*mask.at(x, y));
      }
      ++runs;
    }
    std::memcpy(bytes.data() + count_at, &runs, sizeof(runs));
  }
  return bytes;
}

bool unpack_person(std::span<const std::byte> bytes, int width, int height, Image8& image, Image8& mask) {
  if (bytes.size() / 2 < static_cast<size_t>(height)) return false;  // before anything of a hostile size is taken
  image = Image8::black(width, height, 3);
  mask = Image8::black(width, height, 1);
  const auto* next = reinterpret_cast<const uint8_t*>(bytes.data());
  const uint8_t* const end = next + bytes.size();
  const auto number = [&] {
    const int value = next[0] | next[1] << 8;
    next += 2;
    return value;
  };
  for (int y = 0; y < height; ++y) {
    if (end - next < 2) return false;
    for (int runs = number(); runs > 0; --runs) {
      if (end - next < 4) return false;
      const int x = number(), length = number();
      if (x + length > width || end - next < 4 * static_cast<ptrdiff_t>(length)) return false;
      uint8_t* colour = image.at(x, y);
      uint8_t* alpha = mask.at(x, y);
      for (int i = 0; i < length; ++i, next += 4) {
        colour[3 * i] = next[0];
        colour[3 * i + 1] = next[1];
        colour[3 * i + 2] = next[2];
        alpha[i] = next[3];
      }
    }
  }
  return next == end;
}

}  // namespace degas
