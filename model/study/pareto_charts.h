#pragma once

#include <nlohmann/json.hpp>

#include "model/study/scatter_chart.h"

namespace degas {

/// A string of JSON as HTML has it.
std::string escaped_text(const nlohmann::json& value);

/// "held-out camera" or the name of the novel sequence, as people read it.
std::string capture_title(const std::string& capture);

/// The captures that were measured on, novel sequences first: what an avatar is for.
std::vector<std::string> captures_by_use(const nlohmann::json& pareto);
/// The measures that have charts, of those that there are.
std::vector<std::string> charted_measures(const nlohmann::json& pareto, const std::string& capture);

/// Frames/s against a measure: all points of pareto.json, their front, and the published points that have the measure.
ScatterChart speed_chart(const nlohmann::json& pareto, const std::string& capture, const std::string& measure);

/// A measure at each milestone against minutes of training; strong are the lines of the front of speed and measure.
ScatterChart training_chart(const nlohmann::json& pareto, const std::string& capture, const std::string& measure);

}  // namespace degas
