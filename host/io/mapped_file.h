#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace degas {

/// A file's bytes in memory, read from disk as they are touched. Threads may share it.
class MappedFile {
 public:
  /// Error naming the file when it is missing, empty or cannot be mapped.
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::span<const std::byte> bytes_;
};

}  // namespace degas
