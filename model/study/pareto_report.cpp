#include "model/study/pareto_report.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "host/io/image.h"
#include "model/study/measures.h"
#include "model/study/pareto_answers.h"
#include "model/study/pareto_charts.h"
#include "model/study/pareto_script.h"
#include "model/train/html.h"

namespace degas {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int picture_height = 480;

std::string chart_section(const json& pareto) {
  std::string html = "<h2>Speed and quality</h2>" + baseline_section(pareto) +
                     "<p>Up and to the right is better. Hover for the configuration, click for its pictures. Hollow "
                     "triangles are published figures, of other hardware and other captures: they tell of neither "
                     "speed nor quality on this one.</p>";
  for (const std::string& capture : captures_by_use(pareto)) {
    html += "<h3>" + escape(capture_title(capture)) + "</h3><div class=\"charts\">";
    for (const std::string& measure : charted_measures(pareto, capture))
      html += scatter_svg(speed_chart(pareto, capture, measure));
    html += "</div>";
  }
  html +=
      "<h2>Training time and quality</h2><p>Measured on at most sixteen evenly spaced frames, the last time too. The "
      "learning rate follows the whole budget where the config has a schedule: a run with a shorter budget ends higher "
      "than these lines pass there. Strong lines are those of the front.</p>";
  for (const std::string& capture : captures_by_use(pareto)) {
    html += "<div class=\"charts\">";
    for (const std::string& measure : charted_measures(pareto, capture))
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
  const std::vector<std::string> captures = captures_by_use(pareto);
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
    html += fmt::format("<tr><td><button data-point=\"{}\">{}</button></td>", i, escaped_text(point["name"]));
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
    for (const std::string& capture : captures_by_use(pareto)) {
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
      escaped_text(pareto.at("data")), escape(fmt::format("{}", fmt::join(hold_out, ", "))),
      escaped_text(pareto.at("budget")), pareto.at("seeds").get<int>(), pareto.at("seeds") == 1 ? "" : "s",
      escaped_text(points[0]["device"]), escaped_text(points[0]["driver"]), escaped_text(points[0]["commit"]));
  for (const json& failure : pareto.at("failures")) html += "<p>Not trained: " + escaped_text(failure) + "</p>";
  html += choice_section(pareto) + chart_section(pareto);
  html += "<h2>Pictures</h2><div id=\"detail\"><p>Click a configuration: truth, render, error times 4.</p></div>";
  html += figure_table(pareto);
  html += "<script type=\"application/json\" id=\"data\">" + embedded(script_data(pareto, folder)) + "</script>";
  return html + "<script>" + pareto_script + "</script></body></html>\n";
}

}  // namespace degas
