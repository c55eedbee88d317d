#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace degas {

/// HTML of pareto.json: which configuration to take for so many frames/s and why, with the controls by which the page's
/// script takes another device's speed.
std::string choice_section(const nlohmann::json& pareto);

/// HTML: the best of ours against the best baseline, and on which fronts baselines are; empty without baselines.
std::string baseline_section(const nlohmann::json& pareto);

}  // namespace degas
