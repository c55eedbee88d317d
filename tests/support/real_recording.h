#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

namespace degas::test {

/// The rigs of cameras.json (docs/captures.md) for cameras 0 .. count - 1 of the recording in data/real/caliscope_4cam,
/// by its camera_array.toml.
nlohmann::json caliscope_rigs(const std::filesystem::path& recording, int count);

/// A capture of that recording as a user makes it: cameras.json, and these frames of each camera's video (lossless, so
/// that a few take seconds to look through).
void write_caliscope_capture(const std::filesystem::path& recording, const std::filesystem::path& folder, int cameras,
                             const std::vector<int>& frames);

}  // namespace degas::test
