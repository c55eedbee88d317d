#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace degas {

/// Reads a zip archive (stored or deflated entries, zip64). Nothing is believed before it is checked: an entry's size
/// must be plausible for its compressed bytes (input_limits.h), those must fit the archive, the checksum must hold, and
/// no name may lead out of the archive, though none is ever written. Errors name the archive, the entry and the reason.
/// May be read from several threads.
class ZipReader {
 public:
  explicit ZipReader(const std::filesystem::path& path);
  /// An archive in memory; `label` stands for the path in errors.
  ZipReader(std::vector<std::byte> bytes, std::string label);
  ~ZipReader();

  const std::string& label() const { return label_; }
  /// Of the whole archive.
  size_t bytes() const { return archive_bytes_; }
  /// In the order of the archive's directory.
  const std::vector<std::string>& names() const { return names_; }
  bool contains(const std::string& name) const { return index_.count(name) > 0; }
  std::vector<std::byte> read(const std::string& name) const;

 private:
  struct Archive;
  void list_entries();

  std::string label_;
  size_t archive_bytes_ = 0;
  std::unique_ptr<Archive> archive_;
  std::vector<std::string> names_;
  std::map<std::string, size_t> index_;
  mutable std::mutex mutex_;
};

struct ZipEntry {
  std::string name;
  std::vector<std::byte> bytes;
};

/// A zip archive of the entries, in order; the bytes depend on nothing but the entries (fixed time stamps).
std::vector<std::byte> make_zip(std::span<const ZipEntry> entries, bool compress);

}  // namespace degas
