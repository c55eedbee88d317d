#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace degas {

/// May a file name a folder beside it so? Nothing that leads elsewhere.
bool is_folder_name(std::string_view name);

/// The pictures of a folder whose names are a prefix, a frame number of at least `digits` digits and an extension
/// (jpg, jpeg or png; that of most of them). Other files are passed over; a folder that is not there has none.
class NumberedFiles {
 public:
  NumberedFiles() = default;
  NumberedFiles(std::filesystem::path folder, std::string prefix, int digits);

  const std::filesystem::path& folder() const { return folder_; }
  const std::vector<int64_t>& numbers() const { return numbers_; }  ///< ascending
  bool contains(int64_t number) const;
  /// Where that number's file lies, or would.
  std::filesystem::path path(int64_t number) const;

 private:
  std::filesystem::path folder_;
  std::string prefix_, extension_ = ".jpg";
  int digits_ = 0;
  std::vector<int64_t> numbers_;
};

}  // namespace degas
