#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace degas {

/// One HTML page that needs no other file, of pareto.json and the evaluations' sheets below `folder`: which
/// configuration to take for so many frames/s and why, the charts (hover names a configuration and its figures, a click
/// shows its pictures), training curves, and a table of all figures. Tables and charts are whole without a script; it
/// adds pictures and another device's speed.
std::string pareto_report(const nlohmann::json& pareto, const std::filesystem::path& folder);

}  // namespace degas
