#include "model/study/pareto.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/study/measures.h"
#include "model/study/published.h"

namespace degas {
namespace {

using nlohmann::json;

/// Means over the seeds that have been made.
class Means {
 public:
  void add(const std::string& key, const json& value) {
    if (value.is_number()) values_[key].push_back(value.get<double>());
  }
  void store(json& target) const {
    for (const auto& [key, list] : values_) target[key] = spread_of(list).mean;
  }

 private:
  std::map<std::string, std::vector<double>> values_;
};

json measures_of(const std::vector<const json*>& records, const std::string& capture) {
  std::map<std::string, std::vector<double>> values;
  for (const json* record : records) {
    for (const auto& [key, value] : record->at("evaluations").at(capture).at("metrics").items()) {
      if (is_measure(key) && value.is_number()) values[key].push_back(value.get<double>());
    }
  }
  json found = json::object();
  for (const auto& [key, list] : values) found[key] = spread_of(list).json();
  return found;
}

/// Each milestone's means over the seeds.
json times_of(const std::vector<const json*>& records) {
  json times = json::array();
  for (size_t i = 0; i < records.front()->at("times").size(); ++i) {
    json time;
    Means figures;
    std::map<std::string, Means> curves;
    for (const json* record : records) {
      const json& at = record->at("times").at(i);
      figures.add("minutes", at.at("minutes"));
      figures.add("steps", at.at("steps"));
      for (const auto& [capture, measures] : at.at("curve").items()) {
        for (const auto& [measure, value] : measures.items()) curves[capture].add(measure, value);
      }
    }
    figures.store(time);
    for (const auto& [capture, curve] : curves) curve.store(time["curve"][capture]);
    times.push_back(time);
  }
  return times;
}

json point_of(const StudySetup& setup, const Variant& variant, const Variant& base,
              const std::vector<const json*>& records) {
  const json& first = *records.front();
  json point = {{"name", variant.name},
                {"baseline", variant.is_baseline},
                {"config_file", variant.config_file.string()},
                {"overrides", variant.overrides},
                {"differences", config_differences(base.config, variant.config)},
                {"seeds", records.size()},
                {"command", first.at("command")},
                {"commit", first.at("commit")},
                {"device", first.at("training").at("device")},
                {"driver", first.at("training").at("driver")},
                {"times", times_of(records)}};
  Means means;
  for (const json* record : records) {
    const json& training = record->at("training");
    for (const char* key : {"minutes", "steps", "parameters", "gaussians"}) means.add(key, training.at(key));
    means.add("training_memory_mib", training.at("memory_mib"));
    means.add("memory_mib", record->at("memory_mib"));
    const json& metrics = record->at("evaluations").at("view").at("metrics");
    for (const char* key : {"decode_ms", "render_ms"}) means.add(key, metrics.at(key));
  }
  means.store(point);
  point["fps"] = 1000 / (point["decode_ms"].get<double>() + point["render_ms"].get<double>());
  for (const StudyEvaluation& evaluation : setup.evaluations()) {
    point["quality"][evaluation.name] = measures_of(records, evaluation.name);
    point["folders"][evaluation.name] = first.at("evaluations").at(evaluation.name).at("folder");
  }
  return point;
}

/// By capture and measure the points on the front of speed and that measure.
json fronts_of(const json& points, const std::string& capture) {
  json fronts = json::object();
  if (points.empty()) return fronts;
  for (const auto& [measure, spread] : points[0]["quality"][capture].items()) {
    std::vector<FrontPoint> places;
    for (const json& point : points) {
      const json& qualities = point["quality"][capture];
      const double quality = qualities.contains(measure) ? qualities[measure]["mean"].get<double>()
                                                         : std::numeric_limits<double>::quiet_NaN();
      places.push_back({point["fps"].get<double>(), lower_is_better(measure) ? -quality : quality});
    }
    fronts[measure] = pareto_front(places);
  }
  return fronts;
}

}  // namespace

std::vector<size_t> pareto_front(const std::vector<FrontPoint>& points) {
  std::vector<size_t> order;
  for (size_t i = 0; i < points.size(); ++i) {
    if (std::isfinite(points[i].speed) && std::isfinite(points[i].quality)) order.push_back(i);
  }
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    if (points[a].speed != points[b].speed) return points[a].speed > points[b].speed;
    if (points[a].quality != points[b].quality) return points[a].quality > points[b].quality;
    return a < b;
  });
  // From fast to slow: what is slower must be better than all before, or equal to the last of them in both.
  std::vector<size_t> front;
  for (const size_t i : order) {
    const bool is_better = front.empty() || points[i].quality > points[front.back()].quality;
    const bool is_equal = !front.empty() && points[i].quality == points[front.back()].quality &&
                          points[i].speed == points[front.back()].speed;
    if (is_better || is_equal) front.push_back(i);
  }
  std::reverse(front.begin(), front.end());
  return front;
}

json pareto_json(const StudySetup& setup, const std::vector<Variant>& variants, const StudyResult& result) {
  json pareto = {{"data", setup.data.string()}, {"hold_out", setup.hold_out},  {"budget", setup.budget.text()},
                 {"seeds", setup.seeds},        {"failures", result.failures}, {"points", json::array()}};
  for (size_t i = 0; i < variants.size(); ++i) {
    std::vector<const json*> records;
    for (const json& record : result.records[i]) {
      if (!record.is_null()) records.push_back(&record);
    }
    if (!records.empty()) pareto["points"].push_back(point_of(setup, variants[i], variants[0], records));
  }
  for (const StudyEvaluation& evaluation : setup.evaluations()) {
    pareto["measured_on"].push_back(evaluation.name);
    pareto["fronts"][evaluation.name] = fronts_of(pareto["points"], evaluation.name);
  }
  for (const PublishedRow& row : published_rows()) {
    if (row.table != "methods" || row.frames_per_second <= 0) continue;
    pareto["published"].push_back({{"name", row.label},
                                   {"fps", row.frames_per_second},
                                   {"quality", row.figures},
                                   {"data", row.data},
                                   {"hardware", row.hardware}});
  }
  return pareto;
}

std::vector<Choice> choices(const json& pareto, const std::string& capture, const std::string& measure) {
  std::vector<Choice> rows;
  for (const json& index : pareto.at("fronts").at(capture).value(measure, json::array())) {
    const size_t point = index.get<size_t>();
    rows.push_back(
        {point, rows.empty() ? 0.0 : rows.back().up_to, pareto.at("points").at(point).at("fps").get<double>()});
  }
  return rows;
}

}  // namespace degas
