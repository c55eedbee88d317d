#include "model/study/pareto_report.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "host/io/image.h"
#include "model/study/measures.h"
#include "model/study/pareto.h"
#include "model/study/pareto_charts.h"
#include "model/study/pareto_script.h"
#include "model/train/html.h"

namespace degas {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int picture_height = 480;

std::string text_of(const json& value) {
  return escape(value.get<std::string>());
}

/// The measures that have a chart, of those that there are.
std::vector<std::string> charted(const json& pareto, const std::string& capture) {
  std::vector<std::string> measures;
  for (const char* measure : {"psnr", "lpips", "face_lpips"}) {
    if (pareto["fronts"][capture].contains(measure)) measures.push_back(measure);
  }
  return measures;
}

/// Novel sequences first: what an avatar is for.
std::vector<std::string> captures_of(const json& pareto) {
  auto captures = pareto.at("measured_on").get<std::vector<std::string>>();
  std::rotate(captures.begin(), captures.begin() + 1, captures.end());
  return captures;
}

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
                        text_of(better["name"]), measure_text(measure, gain, true), rows[k].faster_than,
                        rows[k].faster_than);
    }
    html += fmt::format(
        "<tr data-from=\"{0:.4g}\" data-to=\"{1:.4g}\"><td><span data-fps=\"{0:.4g}\">{0:.1f}</span> to "
        "<span data-fps=\"{1:.4g}\">{1:.1f}</span></td><td><button data-point=\"{2}\">{3}</button></td><td>{4}</td>"
        "<td>{5}</td></tr>",
        rows[k].faster_than, rows[k].up_to, rows[k].point, text_of(point["name"]), measure_text(measure, quality), why);
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
                       text_of(fastest["name"]), rows.back().up_to);
  }
  const json& point = pareto["points"][found->point];
  return fmt::format("<b>{}</b> ({:.1f} frames/s, {} {})", text_of(point["name"]), found->up_to, measure_label(measure),
                     measure_text(measure, point["quality"][capture][measure]["mean"].get<double>()));
}

std::string choice_section(const json& pareto) {
  std::string html = "<h2>Which one to take</h2>";
  for (const std::string& capture : captures_of(pareto)) {
    for (const std::string& measure : charted(pareto, capture))
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
    html += fmt::format("<option value=\"{}\">{}</option>", i, text_of(pareto["points"][i]["name"]));
  html +=
      "</select></label> <label>makes <input id=\"speed\" type=\"number\" min=\"0\" step=\"any\" placeholder=\"as "
      "here\"> "
      "frames/s.</label></p><div class=\"charts\">";
  for (const std::string& capture : captures_of(pareto)) {
    for (const std::string& measure : charted(pareto, capture)) html += choice_table(pareto, capture, measure);
  }
  return html + "</div>";
}

/// Baselines that win somewhere are named.
std::string front_section(const json& pareto) {
  std::vector<std::string> wins;
  bool has_baselines = false;
  for (const json& point : pareto["points"]) has_baselines = has_baselines || point["baseline"].get<bool>();
  for (const std::string& capture : captures_of(pareto)) {
    for (const auto& [measure, front] : pareto["fronts"][capture].items()) {
      for (const json& index : front) {
        const json& point = pareto["points"][index.get<size_t>()];
        if (point["baseline"].get<bool>())
          wins.push_back(fmt::format("{} ({}, {})", text_of(point["name"]), escape(measure_label(measure)),
                                     escape(capture_title(capture))));
      }
    }
  }
  if (!has_baselines) return "";
  return wins.empty() ? "<p>No baseline is on any front.</p>"
                      : fmt::format("<p>Baselines on a front: {}.</p>", fmt::join(wins, "; "));
}

std::string chart_section(const json& pareto) {
  std::string html = "<h2>Speed and quality</h2>" + front_section(pareto) +
                     "<p>Up and to the right is better. Hover for the configuration, click for its pictures. Hollow "
                     "triangles are published figures, of other hardware and other captures: they tell of neither "
                     "speed nor quality on this one.</p>";
  for (const std::string& capture : captures_of(pareto)) {
    html += "<h3>" + escape(capture_title(capture)) + "</h3><div class=\"charts\">";
    for (const std::string& measure : charted(pareto, capture))
      html += scatter_svg(speed_chart(pareto, capture, measure));
    html += "</div>";
  }
  html +=
      "<h2>Training time and quality</h2><p>Measured on at most sixteen evenly spaced frames, the last time too. The "
      "learning rate follows the whole budget where the config has a schedule: a run with a shorter budget ends higher "
      "than these lines pass there. Strong lines are those of the front.</p>";
  for (const std::string& capture : captures_of(pareto)) {
    html += "<div class=\"charts\">";
    for (const std::string& measure : charted(pareto, capture))
      html += scatter_svg(training_chart(pareto, capture, measure));
    html += "</div>";
  }
  return html;
}

std::string figure_table(const json& pareto) {
  std::string html =
      "<h2>All figures</h2><div class=\"wide\"><table class=\"figures\"><tr><th>configuration</th><th>frames/s</th>"
      "<th>decode, ms</th><th>render, ms</th><th>Gaussians</th><th>parameters</th><th>memory, MiB</th>"
      "<th>in training, MiB</th><th>steps</th><th>minutes</th>";
  const std::vector<std::string> captures = captures_of(pareto);
  std::map<std::string, std::vector<std::string>> measures;
  for (const std::string& capture : captures) {
    json there = json::object();
    for (const auto& [measure, spread] : pareto["points"][0]["quality"][capture].items())
      there[measure] = spread["mean"];
    measures[capture] = shown_measures(there);
    for (const std::string& measure : measures[capture])
      html += fmt::format("<th>{}<br>{}</th>", escape(measure_label(measure)), escape(capture_title(capture)));
  }
  html += "</tr>";
  for (size_t i = 0; i < pareto["points"].size(); ++i) {
    const json& point = pareto["points"][i];
    html += fmt::format("<tr><td><button data-point=\"{}\">{}</button></td>", i, text_of(point["name"]));
    html += fmt::format("<td data-fps=\"{0:.4g}\">{0:.1f}</td>", point["fps"].get<double>());
    for (const auto& [key, digits] : {std::pair<const char*, int>{"decode_ms", 1},
                                      {"render_ms", 1},
                                      {"gaussians", 0},
                                      {"parameters", 0},
                                      {"memory_mib", 0},
                                      {"training_memory_mib", 0},
                                      {"steps", 0},
                                      {"minutes", 1}})
      html += fmt::format("<td>{:.{}f}</td>", point[key].get<double>(), digits);
    for (const std::string& capture : captures) {
      for (const std::string& measure : measures[capture]) {
        const json& spread = point["quality"][capture].value(measure, json());
        std::string cell = spread.is_null() ? "&ndash;" : measure_text(measure, spread["mean"].get<double>());
        if (spread.contains("deviation"))
          cell += " &plusmn;" + measure_text(measure, spread["deviation"].get<double>());
        html += "<td>" + cell + "</td>";
      }
    }
    html += "</tr>";
  }
  return html + "</table></div>";
}

/// The sheet (truth, render, error) in the middle of an evaluation, as a JPEG for an address; empty where there is
/// none.
std::string picture_of(const fs::path& evaluation) {
  std::vector<fs::path> sheets;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(evaluation / "sheets", ignored)) {
    if (entry.path().extension() == ".png") sheets.push_back(entry.path());
  }
  if (sheets.empty()) return "";
  std::sort(sheets.begin(), sheets.end());
  Image8 sheet = read_image(sheets[sheets.size() / 2]);
  if (sheet.height > picture_height)
    sheet = resized(sheet, static_cast<int>(std::lround(1.0 * sheet.width * picture_height / sheet.height)),
                    picture_height);
  const std::vector<std::byte> bytes = encode_image(sheet, ".jpg");
  return "data:image/jpeg;base64," + base64({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

/// What the script shows of each configuration.
json script_data(const json& pareto, const fs::path& folder) {
  json data = json::array();
  for (const json& point : pareto["points"]) {
    json entry = {{"name", point["name"]},       {"fps", point["fps"]},          {"differences", point["differences"]},
                  {"command", point["command"]}, {"commit", point["commit"]},    {"config", point["config_file"]},
                  {"set", point["overrides"]},   {"baseline", point["baseline"]}};
    for (const std::string& capture : captures_of(pareto)) {
      json picture = {{"title", capture_title(capture)},
                      {"source", picture_of(folder / point["folders"][capture].get<std::string>())}};
      for (const auto& [measure, spread] : point["quality"][capture].items())
        picture["figures"].push_back(measure_label(measure) + " " +
                                     measure_text(measure, spread["mean"].get<double>()));
      entry["pictures"].push_back(picture);
    }
    data.push_back(entry);
  }
  return data;
}

/// JSON that may stand within a script element.
std::string embedded(const json& data) {
  std::string text = data.dump(-1, ' ', true, json::error_handler_t::replace), out;
  for (const char c : text) out += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return out;
}

}  // namespace

std::string pareto_report(const json& pareto, const fs::path& folder) {
  std::string html = page_head("degas: speed and accuracy");
  html += pareto_style;
  const json& points = pareto.at("points");
  if (points.empty()) return html + "<p>Nothing has been trained yet.</p></body></html>\n";
  std::vector<std::string> hold_out = pareto.at("hold_out");
  html += fmt::format(
      "<p>Trained on {}, held out {}; {} of training for each configuration, {} seed{}. Device: {} ({}), commit {}. "
      "Speed is the mean time to decode a frame and draw one view of it.</p>",
      text_of(pareto.at("data")), escape(fmt::format("{}", fmt::join(hold_out, ", "))), text_of(pareto.at("budget")),
      pareto.at("seeds").get<int>(), pareto.at("seeds") == 1 ? "" : "s", text_of(points[0]["device"]),
      text_of(points[0]["driver"]), text_of(points[0]["commit"]));
  for (const json& failure : pareto.at("failures")) html += "<p>Not trained: " + text_of(failure) + "</p>";
  html += choice_section(pareto) + chart_section(pareto);
  html += "<h2>Pictures</h2><div id=\"detail\"><p>Click a configuration: truth, render, error times 4.</p></div>";
  html += figure_table(pareto);
  html += "<script type=\"application/json\" id=\"data\">" + embedded(script_data(pareto, folder)) + "</script>";
  return html + "<script>" + pareto_script + "</script></body></html>\n";
}

}  // namespace degas
