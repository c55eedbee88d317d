#include "host/io/input_limits.h"

#include "host/error.h"

namespace degas {

void check_json(std::string_view text, const std::string& label) {
  int depth = 0, values = 0;
  bool in_string = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      i += c == '\\';
      in_string = c != '"';
      continue;
    }
    in_string = c == '"';
    const bool opens = c == '[' || c == '{';
    depth += opens - (c == ']' || c == '}');
    values += opens || c == ',';
    if (depth > deepest_json) {
      throw Error::format("{}: JSON nested more than {} levels deep is not read", label, deepest_json);
    }
    if (values > most_json_values) {
      throw Error::format("{}: JSON of more than {} values is not read", label, most_json_values);
    }
  }
}

std::string_view checked_json(std::span<const std::byte> bytes, const std::string& label) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  check_json(text, label);
  return text;
}

}  // namespace degas
