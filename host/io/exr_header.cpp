#include "host/io/exr_header.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>

#include "host/error.h"
#include "host/io/input_limits.h"

namespace degas {
namespace {

// OpenEXR file layout, https://openexr.com/en/latest/OpenEXRFileLayout.html
constexpr uint32_t exr_magic = 20000630;
constexpr uint32_t tiled = 0x200, deep = 0x800, multipart = 0x1000;
constexpr int channel_bytes = 16;               ///< of a channel's description behind its name
constexpr int dwaa = 8;                         ///< of the compressions; the later ones are lossy like it
constexpr int64_t buffered_rows = 32;           ///< that the library decodes at once, at most
constexpr uint64_t freely = uint64_t{4} << 20;  ///< bytes that any file may claim

/// Of the types that take so many bytes, always.
constexpr std::array<std::pair<std::string_view, size_t>, 22> fixed_sizes = {
    {{"box2i", 16},      {"box2f", 16}, {"chromaticities", 32},
     {"compression", 1}, {"double", 8}, {"envmap", 1},
     {"float", 4},       {"int", 4},    {"keycode", 28},
     {"lineOrder", 1},   {"m33f", 36},  {"m33d", 72},
     {"m44f", 64},       {"m44d", 128}, {"rational", 8},
     {"timecode", 8},    {"v2i", 8},    {"v2f", 8},
     {"v2d", 16},        {"v3i", 12},   {"v3f", 12},
     {"v3d", 24}}};

class ExrHeaderReader {
 public:
  ExrHeaderReader(std::span<const std::byte> file, const std::string& label)
      : file_(file), left_(file), label_(label) {}

  void check() {
    if (left_.size() < 8 || number(take(4)) != exr_magic) fail("it does not begin like one");
    if (number(take(4)) & (tiled | deep | multipart)) fail("it is tiled, deep or of several parts");
    for (std::string_view name = word(); !name.empty(); name = word()) {
      const std::string_view type = word();
      const uint32_t size = number(take(4));
      attribute(name, type, take(size));
    }
    // In 64 bits and long double: a damaged window may span all integers.
    const auto rows = static_cast<long double>(std::max(height_, buffered_rows));
    const long double claimed = static_cast<long double>(width_) * rows * static_cast<long double>(pixel_bytes_);
    if (width_ < 1 || height_ < 1 || claimed > 0x1p50L ||
        (claimed > freely && !is_plausible_expansion(file_.size(), static_cast<uint64_t>(claimed)))) {
      fail(fmt::format("it claims {}x{} pixels of {} bytes; the file is damaged", width_, height_, pixel_bytes_));
    }
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw Error::format("{}: cannot be read as OpenEXR: {}", label_, reason);
  }
  std::span<const std::byte> take(size_t count) {
    if (count > left_.size()) fail("its header ends early or claims too much; the file is damaged");
    const auto bytes = left_.first(count);
    left_ = left_.subspan(count);
    return bytes;
  }
  std::string_view word() {
    const auto* begin = reinterpret_cast<const char*>(left_.data());
    const size_t length = std::string_view(begin, left_.size()).find('\0');
    if (length == std::string_view::npos) fail("a name in its header does not end");
    take(length + 1);
    return {begin, length};
  }
  static uint32_t number(std::span<const std::byte> bytes) {
    uint32_t value = 0;
    std::memcpy(&value, bytes.data(), sizeof(value));
    return value;
  }

  void attribute(std::string_view name, std::string_view type, std::span<const std::byte> value) {
    if (type == "preview" || type == "stringvector" || type == "idmanifest" || type == "tiledesc") {
      fail(fmt::format("it has a {}, which is not read", type));
    }
    // The library reads what the type takes, whatever the size says, and would go on in the middle of it.
    const auto known = std::find_if(fixed_sizes.begin(), fixed_sizes.end(), [&](auto& t) { return t.first == type; });
    if (known != fixed_sizes.end() && known->second != value.size()) {
      fail(fmt::format("its {} has {} bytes instead of {}; the file is damaged", name, value.size(), known->second));
    }
    if (name == "channels" && type == "chlist") pixel_bytes_ = bytes_of_channels(value);
    if (name == "compression" && value.size() == 1 && std::to_integer<int>(value[0]) >= dwaa) {
      fail("its compression is lossy or unknown");
    }
    if (name == "dataWindow" && type == "box2i" && value.size() == 16) {
      const auto edge = [&](size_t i) { return int64_t{static_cast<int32_t>(number(value.subspan(4 * i, 4)))}; };
      constexpr int64_t farthest = 1 << 24;
      for (size_t i = 0; i < 4; ++i) {
        if (std::abs(edge(i)) > farthest) fail("its pixels lie absurdly far away; the file is damaged");
      }
      width_ = edge(2) - edge(0) + 1, height_ = edge(3) - edge(1) + 1;
    }
  }
  /// As read: 4 bytes a channel.
  int64_t bytes_of_channels(std::span<const std::byte> list) const {
    int64_t bytes = 0;
    size_t at = 0;
    for (; at < list.size() && list[at] != std::byte{0}; bytes += sizeof(float)) {
      while (at < list.size() && list[at] != std::byte{0}) ++at;
      at += 1 + channel_bytes;
    }
    if (at + 1 != list.size()) fail("its list of channels does not end where it should; the file is damaged");
    return bytes;
  }

  std::span<const std::byte> file_, left_;
  const std::string& label_;
  int64_t width_ = 0, height_ = 0, pixel_bytes_ = 0;
};

}  // namespace

void check_exr_header(std::span<const std::byte> file, const std::string& label) {
  ExrHeaderReader(file, label).check();
}

}  // namespace degas
