#include "model/study/pareto_answers.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "model/study/measures.h"
#include "model/study/pareto.h"
#include "model/study/pareto_charts.h"
#include "model/train/html.h"

namespace degas {
namespace {

using nlohmann::json;

/// A line for each point of the front: up to which speed it is the best.
std::string choice_table(const json& pareto, const std::string& capture, const std::string& measure) {
  const std::vector<Choice> rows = choices(pareto, capture, measure);
  const std::string label = escape(measure_label(measure));
  std::string html = fmt::format(
      "<table class=\"choice\"><caption>By {}, {}</caption><tr><th>if you need, frames/s</th><th>take</th><th>{}</th>"
      "<th>because</th></tr>",
      label, escape(capture_title(capture)), label);
  for (size_t k = 0; k < rows.size(); ++k) {
    const json& point = pareto["points"][rows[k].point];
    const double quality = point["quality"][capture][measure]["mean"].get<double>();
    std::string why = "nothing is better";
    if (k > 0) {
      const json& better = pareto["points"][rows[k - 1].point];
      const double gain = better["quality"][capture][measure]["mean"].get<double>() - quality;
      why = fmt::format("the next better, {} ({}), makes only <span data-fps=\"{:.4g}\">{:.1f}</span>",
                        escaped_text(better["name"]), measure_text(measure, gain, true), rows[k].faster_than,
                        rows[k].faster_than);
    }
    html += fmt::format(
        "<tr data-from=\"{0:.4g}\" data-to=\"{1:.4g}\"><td><span data-fps=\"{0:.4g}\">{0:.1f}</span> to "
        "<span data-fps=\"{1:.4g}\">{1:.1f}</span></td><td><button data-point=\"{2}\">{3}</button></td><td>{4}</td>"
        "<td>{5}</td></tr>",
        rows[k].faster_than, rows[k].up_to, rows[k].point, escaped_text(point["name"]), measure_text(measure, quality),
        why);
  }
  if (!rows.empty()) {
    html += fmt::format(
        "<tr data-from=\"{0:.4g}\" data-to=\"Infinity\"><td>above <span data-fps=\"{0:.4g}\">{0:.1f}</span></td>"
        "<td>none</td><td></td><td>nothing here is as fast</td></tr>",
        rows.back().up_to);
  }
  return html + "</table>";
}

/// Which one at 30 frames/s, in words; the script says it anew for other speeds.
std::string advice(const json& pareto, const std::string& capture, const std::string& measure) {
  constexpr double target = 30;
  const std::vector<Choice> rows = choices(pareto, capture, measure);
  const auto found = std::find_if(rows.begin(), rows.end(), [](const Choice& row) { return row.up_to >= target; });
  if (rows.empty()) return "";
  const json& fastest = pareto["points"][rows.back().point];
  if (found == rows.end()) {
    return fmt::format("none reaches {:g} frames/s here; the fastest is {} with {:.1f}", target,
                       escaped_text(fastest["name"]), rows.back().up_to);
  }
  const json& point = pareto["points"][found->point];
  return fmt::format("<b>{}</b> ({:.1f} frames/s, {} {})", escaped_text(point["name"]), found->up_to,
                     measure_label(measure),
                     measure_text(measure, point["quality"][capture][measure]["mean"].get<double>()));
}

/// Index of the best of ours or of the baselines; nothing where there is none.
std::optional<size_t> best_of(const json& pareto, bool baselines, const std::string& capture,
                              const std::string& measure) {
  std::optional<size_t> best;
  const auto quality = [&](size_t i) { return pareto["points"][i]["quality"][capture][measure]["mean"].get<double>(); };
  for (size_t i = 0; i < pareto["points"].size(); ++i) {
    const json& point = pareto["points"][i];
    if (point["baseline"].get<bool>() != baselines || !point["quality"][capture].contains(measure)) continue;
    if (!best || (lower_is_better(measure) ? quality(i) < quality(*best) : quality(i) > quality(*best))) best = i;
  }
  return best;
}

/// The best of ours against the best baseline, whatever their speeds.
std::string duel_table(const json& pareto) {
  std::string rows;
  for (const std::string& capture : captures_by_use(pareto)) {
    for (const std::string& measure : charted_measures(pareto, capture)) {
      const auto ours = best_of(pareto, false, capture, measure), baseline = best_of(pareto, true, capture, measure);
      if (!ours || !baseline) continue;
      const json &a = pareto["points"][*ours], &b = pareto["points"][*baseline];
      const double x = a["quality"][capture][measure]["mean"], y = b["quality"][capture][measure]["mean"];
      rows += fmt::format(
          "<tr><td>{}, {}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
          escape(measure_label(measure)), escape(capture_title(capture)), escaped_text(a["name"]),
          measure_text(measure, x), escaped_text(b["name"]), measure_text(measure, y),
          lower_is_better(measure) ? fmt::format("{:+.0f} %", 100 * (x / y - 1)) : measure_text(measure, x - y, true));
    }
  }
  if (rows.empty()) return "";
  return "<table><tr><th></th><th>best of ours</th><th></th><th>best baseline</th><th></th><th>ours over it</th></tr>" +
         rows + "</table>";
}

/// Baselines that win somewhere are named.
std::string wins_text(const json& pareto) {
  std::vector<std::string> wins;
  bool has_baselines = false;
  for (const json& point : pareto["points"]) has_baselines = has_baselines || point["baseline"].get<bool>();
  for (const std::string& capture : captures_by_use(pareto)) {
    for (const auto& [measure, front] : pareto["fronts"][capture].items()) {
      for (const json& index : front) {
        const json& point = pareto["points"][index.get<size_t>()];
        if (point["baseline"].get<bool>())
          wins.push_back(fmt::format("{} ({}, {})", escaped_text(point["name"]), escape(measure_label(measure)),
                                     escape(capture_title(capture))));
      }
    }
  }
  if (!has_baselines) return "";
  return wins.empty() ? "<p>No baseline is on any front.</p>"
                      : fmt::format("<p>Baselines on a front: {}.</p>", fmt::join(wins, "; "));
}

}  // namespace

std::string choice_section(const json& pareto) {
  std::string html = "<h2>Which one to take</h2>";
  for (const std::string& capture : captures_by_use(pareto)) {
    for (const std::string& measure : charted_measures(pareto, capture))
      html += fmt::format("<p>For 30 frames/s on this device, by {} ({}): {}.</p>", escape(measure_label(measure)),
                          escape(capture_title(capture)), advice(pareto, capture, measure));
  }
  html +=
      "<p>On another device: train or copy any one run, ask <code>degas eval</code> there for its frames/s, and enter "
      "it. "
      "All speeds of the tables below are then taken as that many times faster or slower; the marked rows are those to "
      "take.</p><p class=\"controls\"><label>I need <input id=\"target\" type=\"number\" value=\"30\" min=\"0\" "
      "step=\"any\"> "
      "frames/s.</label> <label>On my device <select id=\"known\">";
  for (size_t i = 0; i < pareto["points"].size(); ++i)
    html += fmt::format("<option value=\"{}\">{}</option>", i, escaped_text(pareto["points"][i]["name"]));
  html +=
      "</select></label> <label>makes <input id=\"speed\" type=\"number\" min=\"0\" step=\"any\" placeholder=\"as "
      "here\"> "
      "frames/s.</label></p><div class=\"charts\">";
  for (const std::string& capture : captures_by_use(pareto)) {
    for (const std::string& measure : charted_measures(pareto, capture)) html += choice_table(pareto, capture, measure);
  }
  return html + "</div>";
}

std::string baseline_section(const json& pareto) {
  return duel_table(pareto) + wins_text(pareto);
}

}  // namespace degas
