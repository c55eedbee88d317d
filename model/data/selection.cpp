#include "model/data/selection.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <functional>
#include <optional>
#include <sstream>

#include "host/error.h"

namespace degas {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  if (!text.empty() && text.back() == separator) parts.emplace_back();
  return parts;
}

std::optional<int> number(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// How one kind of thing is selected.
struct Selector {
  int count;
  std::function<int(const std::string& part, const std::string& item)> index_of;  ///< Error when there is none
  std::function<void(const std::string& part, const char* reason)> fail;
};

std::vector<int> select(const std::vector<std::string>& parts, const Selector& selector) {
  std::vector<int> chosen;
  std::vector<bool> taken(static_cast<size_t>(selector.count));
  const auto add = [&](int index, const std::string& part) {
    if (taken[static_cast<size_t>(index)]) selector.fail(part, "selects some twice; name each once");
    taken[static_cast<size_t>(index)] = true;
    chosen.push_back(index);
  };
  for (const std::string& part : parts.empty() ? std::vector<std::string>{":"} : parts) {
    const std::vector<std::string> fields = split(part, ':');
    if (fields.size() <= 1) {
      add(selector.index_of(part, part), part);
      continue;
    }
    if (fields.size() > 3) selector.fail(part, "is no single one and no range");
    const int first = fields[0].empty() ? 0 : selector.index_of(part, fields[0]);
    const int last = fields[1].empty() ? selector.count : selector.index_of(part, fields[1]);
    const int stride = fields.size() < 3 || fields[2].empty() ? 1 : number(fields[2]).value_or(0);
    if (stride < 1) selector.fail(part, "has a stride that is no number above 0");
    if (first >= last) selector.fail(part, "is empty: ranges leave their last one out");
    for (int64_t index = first; index < last; index += stride) add(static_cast<int>(index), part);
  }
  return chosen;
}

}  // namespace

std::vector<std::string> selection_parts(const std::string& text) {
  return split(text, ',');
}

std::vector<int> selected_frames(const std::vector<std::string>& parts, int frame_count, const std::string& option) {
  const auto fail = [&](const std::string& part, const char* reason) {
    throw Error::format("{}: '{}' {}; give frames of 0 .. {} as in 0,4,8:20:2", option, part, reason, frame_count - 1);
  };
  const auto index_of = [&](const std::string& part, const std::string& item) {
    const std::optional<int> index = number(item);
    if (!index) fail(part, "is no number");
    // The end of a range may be one behind the last frame.
    if (*index < 0 || *index > frame_count - (part.find(':') == std::string::npos)) {
      fail(part, "lies outside the capture");
    }
    return *index;
  };
  std::vector<int> frames = select(parts, {frame_count, index_of, fail});
  return frames;
}

std::vector<int> selected_cameras(const std::vector<std::string>& parts, const std::vector<std::string>& names,
                                  const std::string& option) {
  const auto fail = [&](const std::string& part, const char* reason) {
    throw Error::format("{}: '{}' {}; give cameras as in {}; cameras here: {}", option, part, reason,
                        "cam00,cam03 or cam00:cam08:2", fmt::join(names, ", "));
  };
  const auto index_of = [&](const std::string&, const std::string& item) {
    const auto found = std::find(names.begin(), names.end(), item);
    if (found == names.end()) {
      throw Error::format("{}: no camera '{}'; cameras here: {}", option, item, fmt::join(names, ", "));
    }
    return static_cast<int>(found - names.begin());
  };
  return select(parts, {static_cast<int>(names.size()), index_of, fail});
}

}  // namespace degas
