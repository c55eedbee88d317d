#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include "host/io/checksum.h"
#include "model/data/packed_capture.h"

namespace degas {

/// The head of a pack, as its bytes lie in the file.
struct PackHeader {
  struct Section {
    uint64_t offset = 0, bytes = 0, sum = 0;
  };
  char magic[8] = {'D', 'E', 'G', 'A', 'S', 'P', 'K', '1'};
  uint64_t file_bytes = 0;
  std::array<Section, pack_section_count> sections;
  uint64_t sum = 0;  ///< of all before

  uint64_t computed_sum() const {
    return Checksum::of({reinterpret_cast<const std::byte*>(this), sizeof(PackHeader) - sizeof(sum)});
  }
};
static_assert(sizeof(PackHeader) == 24 + 24 * pack_section_count && std::endian::native == std::endian::little);

inline constexpr int pack_camera_numbers = 18;

}  // namespace degas
