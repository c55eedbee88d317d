#include "model/train/report.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "host/error.h"
#include "host/io/input_limits.h"
#include "host/io/json_node.h"
#include "model/train/html.h"
#include "model/train/svg_chart.h"

namespace degas {
namespace {

namespace fs = std::filesystem;

std::string read_file(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw Error::format("{}: cannot be read; the report needs it", path.string());
  return {std::istreambuf_iterator<char>(stream), {}};
}

nlohmann::json parse_metrics(const fs::path& path) {
  const nlohmann::json metrics = read_json(path);
  if (!metrics.is_object()) throw Error::format("{}: holds no metrics; evaluate anew with `degas eval`", path.string());
  return metrics;
}

/// A curve for every numeric key of history.jsonl, over steps.
std::map<std::string, ChartSeries> read_history(const fs::path& path) {
  std::map<std::string, ChartSeries> curves;
  std::ifstream stream(path);
  if (!stream) throw Error::format("{}: cannot be read; has this run been trained?", path.string());
  for (std::string line; std::getline(stream, line);) {
    check_json(line, path.string());
    const nlohmann::json row = nlohmann::json::parse(line, nullptr, false);
    // A line cut by a kill does not parse; the run's next start drops it with all that follows.
    if (!row.is_object() || !row.contains("step") || !row["step"].is_number()) break;
    for (const auto& [key, value] : row.items()) {
      if (value.is_number() && key != "step")
        curves[key].points.push_back({row["step"].get<double>(), value.get<double>()});
    }
  }
  for (auto& [key, series] : curves) series.name = key;
  return curves;
}

std::string chart_of(const std::map<std::string, ChartSeries>& curves, const std::vector<std::string>& keys,
                     const std::string& title, bool logarithmic) {
  std::vector<ChartSeries> chosen;
  for (const std::string& key : keys) {
    if (const auto found = curves.find(key); found != curves.end()) chosen.push_back(found->second);
  }
  return chosen.empty() ? std::string() : svg_chart(title, "step", chosen, logarithmic);
}

std::string metrics_table(const std::vector<std::pair<std::string, nlohmann::json>>& columns) {
  constexpr std::pair<const char*, const char*> rows[] = {{"psnr", "PSNR, dB"},
                                                          {"ssim", "SSIM"},
                                                          {"lpips", "LPIPS (AlexNet)"},
                                                          {"fid", "FID"},
                                                          {"face_psnr", "face PSNR, dB"},
                                                          {"face_ssim", "face SSIM"},
                                                          {"face_lpips", "face LPIPS"},
                                                          {"mouth_psnr", "mouth PSNR, dB"},
                                                          {"mouth_ssim", "mouth SSIM"},
                                                          {"mouth_lpips", "mouth LPIPS"},
                                                          {"aed", "AED"},
                                                          {"frames", "frames"},
                                                          {"cameras", "cameras"},
                                                          {"gaussians", "Gaussians"},
                                                          {"parameters", "parameters"},
                                                          {"decode_ms", "decode, ms"},
                                                          {"render_ms", "render, ms"},
                                                          {"fps", "frames/s"}};
  std::string html = "<table><tr><th></th>";
  for (const auto& [name, metrics] : columns) html += "<th>" + escape(name) + "</th>";
  html += "</tr>";
  for (const auto& [key, label] : rows) {
    html += fmt::format("<tr><td>{}</td>", label);
    for (const auto& [name, metrics] : columns) {
      const nlohmann::json value = metrics.value(key, nlohmann::json());
      html += "<td>";
      if (value.is_number_integer()) html += fmt::format("{}", value.get<int64_t>());
      if (value.is_number_float()) html += fmt::format("{:.4g}", value.get<double>());
      if (value.is_array()) html += fmt::format("{}", value.size());
      if (value.is_null()) html += "&ndash;";
      html += "</td>";
    }
    html += "</tr>";
  }
  return html + "</table>";
}

/// Evenly spaced sheets, in the order of their names.
std::vector<fs::path> choose_sheets(const fs::path& folder, int count) {
  std::vector<fs::path> all, chosen;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (entry.path().extension() == ".png") all.push_back(entry.path());
  }
  std::sort(all.begin(), all.end());
  const size_t wanted = std::min<size_t>(all.size(), static_cast<size_t>(std::max(count, 0)));
  for (size_t i = 0; i < wanted; ++i) chosen.push_back(all[i * all.size() / wanted]);
  return chosen;
}

}  // namespace

void write_report(const fs::path& output, const ReportInputs& inputs) {
  const auto curves = read_history(inputs.run / "history.jsonl");
  std::string html = page_head(inputs.title);

  std::vector<std::pair<std::string, nlohmann::json>> columns;
  for (const fs::path& folder : inputs.evaluations) {
    const fs::path file = folder / "metrics.json";
    columns.emplace_back(folder.filename().string(), parse_metrics(file));
  }
  if (!columns.empty()) html += "<h2>Metrics</h2>" + metrics_table(columns);

  html += "<h2>Training</h2><div class=\"charts\">" + chart_of(curves, {"loss", "l1_ssim", "lpips"}, "Loss", true) +
          chart_of(curves, {"validation_psnr", "psnr"}, "PSNR, dB", false) + "</div>";

  for (const fs::path& folder : inputs.evaluations) {
    const std::vector<fs::path> sheets = choose_sheets(folder / "sheets", inputs.pictures);
    if (sheets.empty()) continue;
    const fs::path worst = folder / "worst.png";
    html += fmt::format("<h2>Pictures: {}</h2><p>Truth, render, error.</p>", escape(folder.filename().string()));
    for (const fs::path& sheet : sheets) {
      html += figure(read_file(sheet), "png", escape(sheet.stem().string()));
    }
    if (fs::exists(worst)) html += figure(read_file(worst), "png", "the worst, by the person's box and by the face's");
  }
  const fs::path config = inputs.run / "config.json";
  html += "<h2>Configuration</h2><details><summary>every key</summary><pre>" + escape(read_file(config)) +
          "</pre></details></body></html>\n";

  if (output.has_parent_path()) fs::create_directories(output.parent_path());
  std::ofstream stream(output, std::ios::binary);
  stream << html;
  if (!stream) throw Error::format("{}: cannot be written", output.string());
}

}  // namespace degas
