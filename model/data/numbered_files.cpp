#include "model/data/numbered_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>

namespace degas {
namespace fs = std::filesystem;

bool is_folder_name(std::string_view name) {
  const auto is_plain = [](char c) { return c != '/' && static_cast<unsigned char>(c) >= ' '; };
  return !name.empty() && name != "." && name != ".." && std::all_of(name.begin(), name.end(), is_plain);
}

NumberedFiles::NumberedFiles(fs::path folder, std::string prefix, int digits)
    : folder_(std::move(folder)), prefix_(std::move(prefix)), digits_(digits) {
  std::map<std::string, std::vector<int64_t>> by_extension;
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(folder_, missing)) {
    const std::string stem = entry.path().stem(), extension = entry.path().extension();
    if (extension != ".jpg" && extension != ".jpeg" && extension != ".png") continue;
    if (stem.compare(0, prefix_.size(), prefix_) != 0) continue;
    int64_t number = 0;
    const char* end = stem.data() + stem.size();
    const auto [stopped, error] = std::from_chars(stem.data() + prefix_.size(), end, number);
    // Another number of digits is another series (previews, for instance).
    if (error != std::errc() || stopped != end || stem != fmt::format("{}{:0{}}", prefix_, number, digits_)) continue;
    by_extension[extension].push_back(number);
  }
  for (auto& [extension, numbers] : by_extension) {
    if (numbers.size() <= numbers_.size()) continue;
    extension_ = extension;
    numbers_ = std::move(numbers);
  }
  std::sort(numbers_.begin(), numbers_.end());
}

bool NumberedFiles::contains(int64_t number) const {
  return std::binary_search(numbers_.begin(), numbers_.end(), number);
}

fs::path NumberedFiles::path(int64_t number) const {
  return folder_ / fmt::format("{}{:0{}}{}", prefix_, number, digits_, extension_);
}

}  // namespace degas
