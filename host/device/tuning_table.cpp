#include "host/device/tuning_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/device/user_cache.h"

namespace degas {
namespace {

constexpr int version = 1;

std::string name_of(TuneMode mode) {
  return mode == TuneMode::Full ? "full" : "fast";
}

std::string index_of(const TuningKey& key) {
  return key.device + '\n' + key.driver + '\n' + key.kernel + '\n' + key.shape;
}

/// Throws a JSON library's exception where a value is no whole number that an int holds.
Parameters parameters_of(const nlohmann::json& json) {
  Parameters parameters;
  for (const auto& [name, value] : json.get<std::map<std::string, nlohmann::json>>()) {
    if (!value.is_number_integer() || std::abs(value.get<double>()) > std::numeric_limits<int>::max())
      throw nlohmann::json::out_of_range::create(406, "a parameter is " + value.dump(), &value);
    parameters[name] = value.get<int>();
  }
  return parameters;
}

}  // namespace

std::string to_string(const Parameters& parameters) {
  std::string text;
  for (const auto& [name, value] : parameters) text += fmt::format("{}{}={}", text.empty() ? "" : " ", name, value);
  return text;
}

TuningTable::TuningTable(std::filesystem::path file) : file_(std::move(file)), choices_(read()) {}

TuningTable::Entries TuningTable::read() {
  Entries entries;
  std::ifstream stream(file_, std::ios::binary);
  if (!stream) return entries;
  try {
    const nlohmann::json document = nlohmann::json::parse(stream);
    if (document.at("version") != version) return entries;  // another version's: not damaged, and of no use
    for (const nlohmann::json& item : document.at("choices")) {
      const Entry entry{{item.at("device"), item.at("driver"), item.at("kernel"), item.at("shape"), item.at("source")},
                        {parameters_of(item.at("parameters")),
                         item.at("mode") == name_of(TuneMode::Full) ? TuneMode::Full : TuneMode::Fast, item.at("ms"),
                         item.at("default_ms")}};
      entries.insert_or_assign(index_of(entry.key), entry);
    }
  } catch (const nlohmann::json::exception&) {
    if (!damage_told_) fmt::print(stderr, "tuner: {}: damaged; it is made anew\n", file_.string());
    damage_told_ = true;
    entries.clear();
  }
  return entries;
}

std::string TuningTable::text(const Entries& entries) {
  auto choices = nlohmann::ordered_json::array();
  for (const auto& [index, entry] : entries) {
    choices.push_back({{"device", entry.key.device},
                       {"driver", entry.key.driver},
                       {"kernel", entry.key.kernel},
                       {"shape", entry.key.shape},
                       {"source", entry.key.source},
                       {"parameters", entry.choice.parameters},
                       {"mode", name_of(entry.choice.mode)},
                       {"ms", entry.choice.milliseconds},
                       {"default_ms", entry.choice.default_milliseconds}});
  }
  return nlohmann::ordered_json({{"version", version}, {"choices", choices}}).dump(1) + '\n';
}

std::optional<TuningChoice> TuningTable::find(const TuningKey& key) const {
  const auto found = choices_.find(index_of(key));
  if (found == choices_.end() || found->second.key.source != key.source) return std::nullopt;
  return found->second.choice;
}

bool TuningTable::add(const TuningKey& key, const TuningChoice& choice) {
  added_.insert_or_assign(index_of(key), Entry{key, choice});
  Entries merged = read();
  merged.merge(choices_);  // what the file has lost since
  for (const auto& [index, entry] : added_) merged.insert_or_assign(index, entry);
  choices_ = std::move(merged);
  return replace_cache_file(file_, text(choices_));
}

std::optional<TuneMode> TuningTable::mode() const {
  if (choices_.empty()) return std::nullopt;
  const bool full = std::any_of(choices_.begin(), choices_.end(),
                                [](const auto& entry) { return entry.second.choice.mode == TuneMode::Full; });
  return full ? TuneMode::Full : TuneMode::Fast;
}

}  // namespace degas
