#pragma once

#include "model/study/study_runner.h"

namespace degas {

/// A study's figures: for each variant its records, mean and spread of every measure over seeds, what it has over the
/// first variant in the same pictures, and the paper's figures of the same study. What has not been made yet is left
/// out.
nlohmann::json ablation_json(const std::string& study, const StudySetup& setup, const std::vector<Variant>& variants,
                             const StudyResult& result);

/// The same as tables, a pair for each capture measured on. Reads nothing but the JSON.
std::string ablation_markdown(const nlohmann::json& ablation);

}  // namespace degas
