#pragma once

#include <cstdint>
#include <string>

#include "host/error.h"

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
inline constexpr int most_json_values = 4'000'000;

/// A callback for nlohmann's parse: an Error beginning with `label` for JSON that is nested so deeply, or holds so many
/// values, that it is none of ours. The library copies, compares and prints nested values by recursion.
template <typename Json>
typename Json::parser_callback_t json_limits(std::string label) {
  return [label = std::move(label), values = 0](int depth, typename Json::parse_event_t, Json&) mutable {
    if (depth > deepest_json) {
      throw Error::format("{}: JSON nested more than {} levels deep is not read", label, deepest_json);
    }
    if (++values > most_json_values) {
      throw Error::format("{}: JSON of more than {} values is not read", label, most_json_values);
    }
    return true;
  };
}

}  // namespace degas
