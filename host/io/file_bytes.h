#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace degas {

/// The whole file. Error naming it when it is missing, no regular file or cut short while reading.
std::vector<std::byte> read_file_bytes(const std::filesystem::path& path);

/// A file that is written beside its target under a temporary name until `commit` flushes it to disk and renames it:
/// readers see the old file or the whole new one. Without commit nothing remains. Makes missing parent folders. Errors
/// name the target and the system's reason.
class AtomicFile {
 public:
  explicit AtomicFile(const std::filesystem::path& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void append(std::span<const std::byte> bytes);
  /// Replaces bytes that were appended before.
  void overwrite(size_t at, std::span<const std::byte> bytes);
  /// Bytes appended so far.
  size_t size() const { return size_; }
  void commit();

 private:
  [[noreturn]] void fail(int reason) const;
  void write_at(size_t at, std::span<const std::byte> bytes);

  std::filesystem::path path_, temporary_;
  int file_ = -1;
  size_t size_ = 0;
};

/// Writes the whole of an AtomicFile.
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_text(const std::filesystem::path& path, const std::string& text);

/// The name `path` is written under before its rename: unique per process and call, same folder, same extension.
std::filesystem::path temporary_name(const std::filesystem::path& path);

/// Removes what processes that were killed while writing `path` left under such names; not what a living one writes.
void remove_leftovers_of(const std::filesystem::path& path);

}  // namespace degas
