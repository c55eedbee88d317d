#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace degas {

/// FNV-1a over 8-byte words, the tail by bytes: fast enough for a gigabyte, sensitive to any flipped bit. Against
/// damage, not against malice.
class Checksum {
 public:
  void add(const void* data, size_t bytes) {
    const auto* begin = static_cast<const unsigned char*>(data);
    size_t i = 0;
    for (; i + 8 <= bytes; i += 8) {
      uint64_t word;
      std::memcpy(&word, begin + i, 8);
      mix(word);
    }
    for (; i < bytes; ++i) mix(begin[i]);
  }
  uint64_t value() const { return state_; }

  static uint64_t of(std::span<const std::byte> bytes) {
    Checksum sum;
    sum.add(bytes.data(), bytes.size());
    return sum.value();
  }

 private:
  void mix(uint64_t word) {
    state_ = (state_ ^ word) * 0x100000001b3u;
    state_ ^= state_ >> 32;
  }
  uint64_t state_ = 0xcbf29ce484222325u;
};

}  // namespace degas
