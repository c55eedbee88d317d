#pragma once

// Catch2 of either major version under one set of names: Debian 12 and Ubuntu 22.04 package version 2 (one header),
// Debian 13 and Ubuntu 24.04 version 3 (a library, with the names below elsewhere).
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
#include <string>

using Catch::Approx;

namespace Catch {
using Matchers::StartsWith;
inline auto Contains(const std::string& text) {
  return Matchers::ContainsSubstring(text);
}
}  // namespace Catch
#else
#include <catch2/catch.hpp>
#endif
