#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "host/io/npz.h"
#include "host/io/zip_archive.h"

namespace degas {

/// The face codes of a DREAMS capture: a torch archive a view in dpe/, or the same bundled as dpe.zip or dpe/*.zip, or
/// expression_codes.npz (codes (T,C,N), valid (T,C)); the first of these that exists. Read when asked for, then kept.
class DreamsCodes {
 public:
  /// `frame_numbers` of the rows are what file names count by.
  DreamsCodes(const std::filesystem::path& folder, const std::vector<int64_t>& frame_numbers, int cameras);

  /// Length of the codes, 0 without any.
  int size() const { return size_; }
  /// Error naming the file when a code is damaged, not finite or of another length than the first.
  std::optional<std::vector<float>> code(int frame, int camera) const;
  bool has_code(int frame, int camera) const;
  /// The files that codes come from: one archive, or many small ones.
  std::vector<std::filesystem::path> files() const;

 private:
  using View = std::pair<int, int>;
  void add(const std::string& file_name, const std::string& source, const std::vector<int64_t>& frame_numbers,
           int cameras);
  void read_table(const std::filesystem::path& path, size_t rows, int cameras);
  std::vector<float> read(const std::string& source) const;

  std::filesystem::path folder_;
  std::unique_ptr<ZipReader> bundle_;
  std::map<View, std::string> sources_;  // path of a file, or name in the bundle
  mutable std::mutex mutex_;
  mutable std::map<View, std::vector<float>> codes_;
  std::vector<std::filesystem::path> files_;
  int size_ = 0;
};

}  // namespace degas
