#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "host/io/npy.h"
#include "host/io/zip_archive.h"

namespace degas {

/// A NumPy .npz archive. Arrays are read when asked for, so object arrays that nobody needs do no harm.
class NpzFile {
 public:
  /// Error naming the file when it is missing or no zip archive.
  explicit NpzFile(const std::filesystem::path& path);

  std::vector<std::string> keys() const;
  bool contains(const std::string& key) const { return archive_.contains(key + ".npy"); }
  /// Error naming the file and the key: missing (with the keys that exist), damaged, or of a kind not read.
  NpyArray read(const std::string& key) const;
  /// Also checks the shape; -1 stands for any size.
  NpyArray read(const std::string& key, const Shape& expected) const;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  ZipReader archive_;
};

/// Writes a deflated archive under a temporary name, then renames. Equal arrays give equal bytes.
void write_npz(const std::filesystem::path& path, const std::map<std::string, NpyArray>& arrays);

}  // namespace degas
