#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/io/npz.h"
#include "host/io/zip_archive.h"

namespace degas {

/// "dpe-000012-cam03": what the code of a view is called in files and archives, before .pt or .npy.
std::string code_name(int64_t frame_number, int camera);
/// Is that the name of a view's code, extension included?
bool is_code_file(const std::string& name);

/// Where a folder has, or may have, face codes, of what exists there: folders of single files, bundles and tables, the
/// first that is to be read first.
std::vector<std::filesystem::path> code_places(const std::filesystem::path& folder);

/// Face codes in files, of a length that the first tells. A folder holds, and the first of these that exists is read:
///
///   dpe/, the folder itself a file a view: a torch archive of one tensor or with 'exp' (.pt), or an array (.npy)
///   dpe/*.zip, dpe.zip      the same, bundled
///   expression_codes.npz    a table: codes (T,C,N), or (T,N) for all cameras, and valid (T,C) or (T), not 0
///                           where there is one; without it, where codes are finite
///   expression_codes.npy    a table without valid
///
/// The folder of single files, a bundle and a table may also be named themselves. Codes are read when asked for, then
/// kept.
class DreamsCodes {
 public:
  /// `frame_numbers` of the rows are what file names count by.
  DreamsCodes(const std::filesystem::path& place, const std::vector<int64_t>& frame_numbers, int cameras);

  /// Length of the codes, 0 without any.
  int size() const { return size_; }
  /// Error naming the file when a code is damaged, not finite or of another length than the first.
  std::optional<std::vector<float>> code(int frame, int camera) const;
  bool has_code(int frame, int camera) const;
  /// The files that codes come from: one archive, or many small ones.
  std::vector<std::filesystem::path> files() const;
  /// Torch archives among them whose names tell no view.
  const std::vector<std::string>& misnamed() const { return misnamed_; }

 private:
  using View = std::pair<int, int>;
  void add_files(const std::filesystem::path& folder, const std::vector<int64_t>& frame_numbers, int cameras);
  void add_bundle(const std::filesystem::path& path, const std::vector<int64_t>& frame_numbers, int cameras);
  void add(const std::string& source, const std::vector<int64_t>& frame_numbers, int cameras);
  void add_all(const std::filesystem::path& place, const std::vector<int64_t>& frame_numbers, int cameras);
  void read_table(const std::filesystem::path& path, size_t rows, int cameras);
  std::vector<float> read(const std::string& source) const;

  std::unique_ptr<ZipReader> bundle_;
  std::map<View, std::string> sources_;  // path of a file, or name in the bundle
  mutable std::mutex mutex_;
  mutable std::map<View, std::vector<float>> codes_;
  std::vector<std::filesystem::path> files_;
  std::vector<std::string> misnamed_;
  int size_ = 0;
};

/// The codes at `named`, or, when that is empty, those in the capture's own folder. `warn` is told of archives whose
/// names tell no view. Error when `named` holds none of its frames and cameras.
std::unique_ptr<DreamsCodes> open_codes(const std::filesystem::path& capture, const std::filesystem::path& named,
                                        const std::vector<int64_t>& frame_numbers, int cameras,
                                        const std::function<void(const std::string&)>& warn);

}  // namespace degas
