#pragma once

#include "model/study/study_runner.h"

namespace degas {

/// Speed and quality of one configuration, both the higher the better.
struct FrontPoint {
  double speed, quality;
};
/// Indices of the points that no other beats: none is at least as good in both and better in one. By ascending speed;
/// of equal points each. Points that are not finite are on no front.
std::vector<size_t> pareto_front(const std::vector<FrontPoint>& points);

/// All that the charts and the report show, pictures apart: for each variant that has been made what was set, its
/// figures (means over seeds; spread of the measures), its quality at each milestone, and on which fronts it is. The
/// paper's figures beside it. Keys are those of metrics.json.
nlohmann::json pareto_json(const StudySetup& setup, const std::vector<Variant>& variants, const StudyResult& result);

/// A row of the answer to "which one at so many frames/s?".
struct Choice {
  size_t point;        ///< index in pareto.json's points: the best of those that are fast enough
  double faster_than;  ///< frames/s of the next better one, which is too slow; 0 for the best of all
  double up_to;        ///< its own frames/s
};
/// The front by ascending speed.
std::vector<Choice> choices(const nlohmann::json& pareto, const std::string& capture, const std::string& measure);

}  // namespace degas
