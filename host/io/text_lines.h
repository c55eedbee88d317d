#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace degas {

/// The lines of a text file, each split at blanks; empty lines are passed over. Error when the file cannot be read.
class TextLines {
 public:
  explicit TextLines(const std::filesystem::path& path);

  /// Moves to the next line that has words; false at the end.
  bool next();
  const std::vector<std::string_view>& words() const { return words_; }
  /// Words [first, first + count) as finite numbers. Error naming file and line.
  std::vector<double> numbers(size_t first, size_t count) const;
  /// A text as a whole number; Error naming file and line.
  long whole(std::string_view text) const;
  [[noreturn]] void fail(const std::string& reason) const;

 private:
  std::filesystem::path path_;
  std::string text_;
  size_t at_ = 0;
  int line_ = 0;
  std::vector<std::string_view> words_;
};

}  // namespace degas
