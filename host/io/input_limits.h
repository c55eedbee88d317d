#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace degas {

// What input files may claim before anything is allocated for them.

/// May compressed data of so many bytes be believed to hold `expanded` ones? Deflate expands by at most 1032 : 1; what
/// is large must be better filled than a bomb is. (Pose blend shapes of zeros, which bodies without any have, are 120
/// MB that shrink a thousandfold.)
inline bool is_plausible_expansion(uint64_t compressed, uint64_t expanded) {
  constexpr uint64_t freely = uint64_t{256} << 20;
  const bool is_possible = expanded / 1032 <= compressed + 1;
  return is_possible && (expanded <= freely || expanded / 64 <= compressed);
}

inline constexpr int deepest_json = 100;
inline constexpr int most_json_values = 8'000'000;

/// Error beginning with `label` for JSON that is nested so deeply, or holds so many values, that it is none of ours: the
/// library copies, compares and prints nested values by recursion, and a value takes tens of bytes. To be asked before
/// parsing: with a callback the library's parser takes time by the square of an array's length.
void check_json(std::string_view text, const std::string& label);
/// The bytes as text that has been looked through.
std::string_view checked_json(std::span<const std::byte> bytes, const std::string& label);

}  // namespace degas
