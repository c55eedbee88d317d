#include "model/config.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>
#include <type_traits>

#include "host/error.h"
#include "host/io/input_limits.h"
#include "model/config_fields.h"

namespace degas {
namespace {

using Json = nlohmann::ordered_json;

struct AnyVisitor {
  template <typename Value>
  void operator()(const char*, Value&) {}
};
template <typename Value>
concept Section = requires(Value& value, AnyVisitor& visitor) {
  visit_fields(value, visitor);
};

struct Writer {
  Json json = Json::object();
  template <typename Value>
  void operator()(const char* key, Value& value) {
    if constexpr (Section<Value>) {
      Writer inner;
      visit_fields(value, inner);
      json[key] = std::move(inner.json);
    } else if constexpr (std::is_enum_v<Value>) {
      json[key] = choice_names<Value>()[static_cast<int>(value)];
    } else {
      json[key] = value;
    }
  }
};

template <typename Value>
struct IsList : std::false_type {};
template <typename Item>
struct IsList<std::vector<Item>> : std::true_type {};

size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t substituted = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row.back();
}

/// Bytes that are no UTF-8, which an override may hold, become the replacement character.
std::string text_of(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

/// Where values come from: a file's JSON, or an override, whose value is a string as typed on the command line.
struct Source {
  const std::string& name;
  bool typed_text = false;
};

/// Takes one section's values out of JSON; whatever no field has taken is an unknown key.
class ConfigReader {
 public:
  template <typename Value>
  static void read_section(const Json& json, Value& value, const std::string& section, const Source& source) {
    if (!json.is_object()) {
      throw Error::format("{}: '{}' must be a section of keys, not {}", source.name,
                          section.substr(0, section.size() - 1), text_of(json));
    }
    ConfigReader reader(json, section, source);
    visit_fields(value, reader);
    reader.require_all_known();
  }

  /// Called by visit_fields for every field of the section.
  template <typename Value>
  void operator()(const char* key, Value& value) {
    known_.push_back(key);
    const auto found = json_.find(key);
    if (found == json_.end()) return;
    const std::string path = section_ + key;
    if constexpr (Section<Value>) {
      read_section(*found, value, path + ".", source_);
    } else if (source_.typed_text && found->is_string()) {
      read_text(found->get<std::string>(), value, path);
    } else {
      read_value(*found, value, path);
    }
  }

 private:
  ConfigReader(const Json& json, std::string section, const Source& source)
      : json_(json), section_(std::move(section)), source_(source) {}

  void require_all_known() const {
    for (const auto& [key, value] : json_.items()) {
      if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
      const auto nearest = std::min_element(known_.begin(), known_.end(), [&key = key](const auto& a, const auto& b) {
        return edit_distance(a, key) < edit_distance(b, key);
      });
      throw Error::format("{}: unknown key '{}{}'; the nearest known key is '{}{}'", source_.name, section_, key,
                          section_, *nearest);
    }
  }

  [[noreturn]] void refuse(const std::string& path, const std::string& wanted, const Json& json) const {
    throw Error::format("{}: '{}' must be {}, not {}", source_.name, path, wanted, text_of(json));
  }

  /// Strings need no quotes, and lists may be written a,b,c.
  template <typename Value>
  void read_text(const std::string& text, Value& value, const std::string& path) const {
    if constexpr (std::is_same_v<Value, std::string>) {
      value = text;
    } else {
      const Json json = Json::parse(text, nullptr, false);
      if constexpr (IsList<Value>::value) {
        if (!json.is_array()) {
          Value list;
          std::istringstream stream(text);
          for (std::string item; std::getline(stream, item, ',');) read_text(item, list.emplace_back(), path);
          value = std::move(list);
          return;
        }
      }
      read_value(json.is_discarded() ? Json(text) : json, value, path);
    }
  }

  template <typename Value>
  void read_value(const Json& json, Value& value, const std::string& path) const {
    if constexpr (std::is_same_v<Value, bool>) {
      if (!json.is_boolean()) refuse(path, "true or false", json);
      value = json.template get<bool>();
    } else if constexpr (std::is_integral_v<Value>) {
      read_integer(json, value, path);
    } else if constexpr (std::is_floating_point_v<Value>) {
      if (!json.is_number()) refuse(path, "a number", json);
      value = json.template get<Value>();
    } else if constexpr (std::is_enum_v<Value>) {
      const std::vector<std::string> names = choice_names<Value>();
      const auto found =
          std::find(names.begin(), names.end(), json.is_string() ? json.template get<std::string>() : "");
      if (found == names.end()) refuse(path, fmt::format("one of {}", fmt::join(names, ", ")), json);
      value = static_cast<Value>(found - names.begin());
    } else if constexpr (std::is_same_v<Value, std::string>) {
      if (!json.is_string()) refuse(path, "a string", json);
      value = json.template get<std::string>();
    } else if constexpr (std::is_same_v<Value, std::vector<std::string>>) {
      read_selection(json, value, path);
    } else {
      if (!json.is_array()) refuse(path, "a list", json);
      Value list(json.size());
      for (size_t i = 0; i < json.size(); ++i) read_value(json[i], list[i], fmt::format("{}[{}]", path, i));
      value = std::move(list);
    }
  }

  /// Names, numbers and ranges of cameras or frames: a list, or one text as on the command line.
  void read_selection(const Json& json, std::vector<std::string>& value, const std::string& path) const {
    if (json.is_string()) return read_text(json.get<std::string>(), value, path);
    if (!json.is_array()) refuse(path, "a list", json);
    std::vector<std::string> parts(json.size());
    for (size_t i = 0; i < json.size(); ++i) {
      if (json[i].is_number_integer()) {
        parts[i] = json[i].dump();
      } else {
        read_value(json[i], parts[i], fmt::format("{}[{}]", path, i));
      }
    }
    value = std::move(parts);
  }

  /// 8e5 is a whole number too, and handy.
  template <typename Value>
  void read_integer(const Json& json, Value& value, const std::string& path) const {
    using Limits = std::numeric_limits<Value>;
    const double real = json.is_number() ? json.get<double>() : NAN;
    if (!(std::trunc(real) == real)) refuse(path, "a whole number", json);
    const bool exact = json.is_number_integer() || std::abs(real) < 0x1p53;
    if (!(exact && real >= static_cast<double>(Limits::min()) && real <= static_cast<double>(Limits::max()))) {
      refuse(path, fmt::format("a whole number from {} to {}", Limits::min(), Limits::max()), json);
    }
    value = json.get<Value>();
  }

  const Json& json_;
  const std::string section_;
  const Source& source_;
  std::vector<std::string> known_;
};

Json to_json(const Config& config) {
  Config copy = config;
  Writer writer;
  visit_fields(copy, writer);
  return writer.json;
}

Json parse(const std::string& text, const std::string& name) {
  check_json(text, name);
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& fault) {
    const auto line =
        1 + std::count(text.begin(), text.begin() + static_cast<long>(std::min(fault.byte, text.size())), '\n');
    throw Error::format("{}: line {} is not valid JSON ({})", name, line, fault.what());
  } catch (const Json::exception& fault) {
    throw Error::format("{}: not valid JSON ({})", name, fault.what());
  }
}

void collect_differences(const Json& a, const Json& b, const std::string& prefix,
                         std::vector<std::string>& differences) {
  for (const auto& [key, value] : a.items()) {
    const Json& other = b.at(key);
    if (value.is_object()) {
      collect_differences(value, other, prefix + key + ".", differences);
    } else if (value != other) {
      differences.push_back(prefix + key + " (" + text_of(value) + " / " + text_of(other) + ")");
    }
  }
}

}  // namespace

Config parse_config(const std::string& text, const std::string& name) {
  Config config;
  const Json json = parse(text, name);
  if (!json.is_object()) throw Error::format("{}: the file must hold an object of sections, {{\"net\": ...}}", name);
  ConfigReader::read_section(json, config, "", {name});
  validate(config, name);
  return config;
}

Config load_config(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error::format("{}: cannot be read; give a config file such as configs/quick.json", path.string());
  std::ostringstream text;
  text << file.rdbuf();
  return parse_config(text.str(), path.string());
}

void apply_override(Config& config, const std::string& assignment) {
  const std::string name = "--set " + assignment;
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos) throw Error::format("{}: must look like net.width=0.5", name);
  const std::string key = assignment.substr(0, equals), text = assignment.substr(equals + 1);

  Json overlay = text;
  std::vector<std::string> parts;
  std::istringstream stream(key);
  for (std::string part; std::getline(stream, part, '.');) parts.push_back(part);
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) overlay = Json{{*part, std::move(overlay)}};
  ConfigReader::read_section(overlay, config, "", {name, true});
}

std::string config_text(const Config& config) {
  return text_of(to_json(config), 2) + "\n";
}

std::vector<std::string> config_differences(const Config& a, const Config& b) {
  std::vector<std::string> differences;
  collect_differences(to_json(a), to_json(b), "", differences);
  return differences;
}

}  // namespace degas
