#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "model/data/numbered_files.h"

namespace degas {

/// Gathers what a cache must not confuse into 128 bits (two FNV-1a hashes). Files count by path, size and time of
/// change, not by content: videos are too large to read at every start.
class Identity {
 public:
  void add(std::string_view text);
  /// A file or folder; Error naming it when it is missing.
  void add_file(const std::filesystem::path& path);
  /// Every file of a series.
  void add_files(const NumberedFiles& files);
  /// 32 hexadecimal digits.
  std::string text() const;

 private:
  uint64_t low_ = 0xcbf29ce484222325u, high_ = 0x84222325cbf29ce4u;
};

}  // namespace degas
