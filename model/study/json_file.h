#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace degas {

/// Null where there is no such file. Error naming the file when it is not JSON.
nlohmann::json read_json_if_any(const std::filesystem::path& path);
/// Indented, whole or not at all. Error naming the file when the disk refuses.
void write_json(const std::filesystem::path& path, const nlohmann::json& json);

}  // namespace degas
