#include "model/study/pareto_charts.h"

#include <fmt/format.h>

#include <algorithm>

#include "model/study/measures.h"
#include "model/train/html.h"

namespace degas {
namespace {

using nlohmann::json;

void name_axes(ScatterChart& chart, const std::string& measure) {
  chart.less_is_better = lower_is_better(measure);
  chart.logarithmic_y = chart.less_is_better;  // decibels are a logarithm already
  chart.y_label = measure_label(measure) + (measure.ends_with("psnr") ? ", dB" : "") +
                  (chart.less_is_better ? " (less is better, upwards)" : "");
}

std::vector<size_t> front_of(const json& pareto, const std::string& capture, const std::string& measure) {
  return pareto.at("fronts").at(capture).value(measure, std::vector<size_t>());
}

}  // namespace

std::string escaped_text(const nlohmann::json& value) {
  return escape(value.get<std::string>());
}

std::string capture_title(const std::string& capture) {
  return capture == "view"                 ? "held-out camera"
         : capture.rfind("novel ", 0) == 0 ? "novel sequence " + capture.substr(6)
                                           : capture;
}

std::vector<std::string> captures_by_use(const json& pareto) {
  auto captures = pareto.at("measured_on").get<std::vector<std::string>>();
  std::rotate(captures.begin(), captures.begin() + 1, captures.end());
  return captures;
}

std::vector<std::string> charted_measures(const json& pareto, const std::string& capture) {
  std::vector<std::string> measures;
  for (const char* measure : {"psnr", "lpips", "face_lpips"}) {
    if (pareto.at("fronts").at(capture).contains(measure)) measures.push_back(measure);
  }
  return measures;
}

ScatterChart speed_chart(const json& pareto, const std::string& capture, const std::string& measure) {
  ScatterChart chart;
  name_axes(chart, measure);
  chart.title = fmt::format("Speed and {}, {}", measure_label(measure), capture_title(capture));
  const json& points = pareto.at("points");
  const std::vector<size_t> front = front_of(pareto, capture, measure);
  chart.x_label = "frames/s, decoding and drawing one view";
  if (!points.empty()) chart.x_label += ", " + points[0].at("device").get<std::string>();
  for (size_t i = 0; i < points.size(); ++i) {
    const json& quality = points[i].at("quality").at(capture);
    if (!quality.contains(measure)) continue;
    ScatterPoint point;
    point.x = points[i].at("fps").get<double>();
    point.y = quality[measure].at("mean").get<double>();
    point.label = points[i].at("name").get<std::string>();
    point.tooltip = fmt::format("{}\n{:.1f} frames/s, {} {}", point.label, point.x, measure_label(measure),
                                measure_text(measure, point.y));
    for (const json& difference : points[i].at("differences")) point.tooltip += "\n" + difference.get<std::string>();
    point.kind = points[i].at("baseline").get<bool>() ? PointKind::Baseline : PointKind::Ours;
    point.on_front = std::find(front.begin(), front.end(), i) != front.end();
    point.is_labelled = point.on_front || point.kind == PointKind::Baseline;
    point.index = static_cast<int>(i);
    if (point.on_front) chart.front.push_back({point.x, point.y});
    chart.points.push_back(point);
  }
  std::sort(chart.front.begin(), chart.front.end());
  for (const json& row : pareto.value("published", json::array())) {
    if (!row.at("quality").contains(measure)) continue;
    ScatterPoint point;
    point.x = row.at("fps").get<double>();
    point.y = row["quality"][measure].get<double>();
    point.label = fmt::format("{}, {}", row.at("name").get<std::string>(), row.at("data").get<std::string>());
    point.tooltip =
        fmt::format("published: {}\n{:.0f} frames/s on {}, {} {}", point.label, point.x,
                    row.at("hardware").get<std::string>(), measure_label(measure), measure_text(measure, point.y));
    point.kind = PointKind::Published;
    point.is_labelled = true;
    chart.points.push_back(point);
  }
  return chart;
}

ScatterChart training_chart(const json& pareto, const std::string& capture, const std::string& measure) {
  ScatterChart chart;
  name_axes(chart, measure);
  chart.title = fmt::format("Training and {}, {}", measure_label(measure), capture_title(capture));
  chart.x_label = "minutes of training";
  const json& points = pareto.at("points");
  const std::vector<size_t> front = front_of(pareto, capture, measure);
  for (size_t i = 0; i < points.size(); ++i) {
    ScatterLine line;
    line.index = static_cast<int>(i);
    line.is_strong = std::find(front.begin(), front.end(), i) != front.end();
    line.tooltip = points[i].at("name").get<std::string>();
    for (const json& time : points[i].at("times")) {
      const json curve = time.at("curve").value(capture, json::object());  // poses are fitted at the end alone
      if (curve.contains(measure))
        line.points.push_back({time.at("minutes").get<double>(), curve[measure].get<double>()});
    }
    if (line.points.empty()) continue;
    ScatterPoint end;
    end.x = line.points.back().first;
    end.y = line.points.back().second;
    end.label = line.tooltip;
    end.tooltip =
        fmt::format("{}\n{:.1f} minutes, {:.0f} steps, {} {}", line.tooltip, end.x, points[i].at("steps").get<double>(),
                    measure_label(measure), measure_text(measure, end.y));
    end.kind = points[i].at("baseline").get<bool>() ? PointKind::Baseline : PointKind::Ours;
    end.on_front = line.is_strong;
    end.index = line.index;
    chart.lines.push_back(line);
    chart.points.push_back(end);
  }
  return chart;
}

}  // namespace degas
