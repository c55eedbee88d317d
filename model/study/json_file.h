#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/error.h"

namespace degas {

/// Null where there is no such file. Error naming the file when it is not JSON.
nlohmann::json read_json_if_any(const std::filesystem::path& path);
/// Indented, whole or not at all. Error naming the file when the disk refuses.
void write_json(const std::filesystem::path& path, const nlohmann::json& json);

/// What `use` makes of the JSON files below `folder`, which a study wrote: where one of them holds other values than it
/// wrote, an Error that says what to do.
template <typename Use>
auto reading_own_json(const std::filesystem::path& folder, const Use& use) {
  try {
    return use();
  } catch (const nlohmann::json::exception& error) {
    throw Error::format("{}: a JSON file there is damaged: {}; remove it, and the same command makes it anew",
                        folder.string(), error.what());
  }
}

}  // namespace degas
