#include "host/io/text_lines.h"

#include <charconv>
#include <cmath>

#include "host/error.h"
#include "host/io/file_bytes.h"

namespace degas {
namespace {

constexpr size_t most_words = 1000;  ///< of a line: no format read this way comes near it

}  // namespace

TextLines::TextLines(const std::filesystem::path& path) : path_(path) {
  const std::vector<std::byte> bytes = read_file_bytes(path);
  text_.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

bool TextLines::next() {
  constexpr std::string_view blanks = " \t\r";
  words_.clear();
  while (words_.empty() && at_ < text_.size()) {
    const size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view line(text_.data() + at_, end - at_);
    at_ = end + 1;
    ++line_;
    for (size_t begin = line.find_first_not_of(blanks); begin != line.npos; begin = line.find_first_not_of(blanks)) {
      const size_t length = std::min(line.find_first_of(blanks, begin), line.size()) - begin;
      if (words_.size() == most_words) fail(fmt::format("has more than {} words", most_words));
      words_.push_back(line.substr(begin, length));
      line.remove_prefix(begin + length);
    }
  }
  return !words_.empty();
}

std::vector<double> TextLines::numbers(size_t first, size_t count) const {
  if (words_.size() < first + count) fail(fmt::format("has {} words, expected {}", words_.size(), first + count));
  std::vector<double> values(count);
  for (size_t i = 0; i < count; ++i) {
    const std::string_view word = words_[first + i];
    const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), values[i]);
    if (failure != std::errc() || end != word.data() + word.size() || !std::isfinite(values[i])) {
      fail(fmt::format("'{}' is no finite number", word));
    }
  }
  return values;
}

long TextLines::whole(std::string_view text) const {
  long value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) fail(fmt::format("'{}' is no whole number", text));
  return value;
}

void TextLines::fail(const std::string& reason) const {
  throw Error::format("{}: line {}: {}", path_.string(), line_, reason);
}

}  // namespace degas
