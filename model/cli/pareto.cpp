#include "model/study/pareto.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/json_node.h"
#include "model/cli/commands.h"
#include "model/cli/study_options.h"
#include "model/study/grid.h"
#include "model/study/json_file.h"
#include "model/study/pareto_charts.h"
#include "model/study/pareto_report.h"

namespace degas {
namespace {

namespace fs = std::filesystem;

struct ParetoOptions {
  StudyChoice choice;
  fs::path grid, baselines, chart;
  std::string measure = "psnr", capture;
};

constexpr const char* baseline_folder = "configs/baselines";

std::vector<Variant> variants_of(const ParetoOptions& options, const Variant& base) {
  std::vector<Variant> all = options.grid.empty() ? default_grid(base) : grid_variants(base, options.grid);
  fs::path folder = options.baselines;
  if (folder.empty() && fs::is_directory(baseline_folder)) folder = baseline_folder;
  if (folder.empty()) {
    fmt::print(stderr, "warning: no baselines to compare with: there is no {} here; name it by --baselines\n",
               baseline_folder);
    return all;
  }
  for (Variant& baseline : baseline_variants(folder, options.choice.overrides)) all.push_back(std::move(baseline));
  return all;
}

/// The main chart of a pareto.json as a picture by itself.
void draw_chart(const ParetoOptions& options) {
  if (options.choice.output.empty()) throw Error("--out: name the SVG file to write");
  const nlohmann::json pareto = read_json(options.chart);
  try {
    const auto captures = pareto.at("measured_on").get<std::vector<std::string>>();
    if (captures.empty()) throw Error::format("{}: holds no measured capture", options.chart.string());
    const std::string capture = options.capture.empty() ? captures.back() : options.capture;
    if (std::find(captures.begin(), captures.end(), capture) == captures.end())
      throw Error::format("--capture {}: {} has {}", capture, options.chart.string(), fmt::join(captures, ", "));
    if (!pareto.at("fronts").at(capture).contains(options.measure)) {
      std::vector<std::string> measures;
      for (const auto& [measure, front] : pareto.at("fronts").at(capture).items()) measures.push_back(measure);
      throw Error::format("--measure {}: {} has {}", options.measure, options.chart.string(),
                          fmt::join(measures, ", "));
    }
    write_text(options.choice.output, scatter_svg(speed_chart(pareto, capture, options.measure)) + "\n");
  } catch (const nlohmann::json::exception& error) {
    throw Error::format("{}: is no pareto.json of `degas pareto`: {}", options.chart.string(), error.what());
  }
  fmt::print("wrote {}\n", options.choice.output.string());
}

void sweep(const ParetoOptions& options) {
  for (const auto& [option, value] : {std::pair<const char*, fs::path>{"--data", options.choice.data},
                                      {"--body", options.choice.body},
                                      {"--out", options.choice.output}}) {
    if (value.empty()) throw Error::format("{} is needed; see `degas pareto --help`", option);
  }
  const Variant base = options.choice.base();
  StudySetup setup = options.choice.setup(base);
  setup.milestones = {0.125, 0.25, 0.5, 1};
  const std::vector<Variant> variants = variants_of(options, base);
  bool is_written = false;
  const auto write = [&](const StudyResult& result) {
    const nlohmann::json pareto = pareto_json(setup, variants, result);
    write_json(setup.output / "pareto.json", pareto);
    write_text(setup.output / "report.html", pareto_report(pareto, setup.output));
    is_written = true;
  };
  const auto tell = [&] {
    if (is_written) fmt::print("wrote {}\n", (setup.output / "pareto.json, report.html").string());
  };
  try {
    run_and_tell(setup, variants, write);
  } catch (...) {
    tell();
    throw;
  }
  tell();
}

}  // namespace

void add_pareto_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "pareto",
      "Chart speed against accuracy: train a grid of configurations and the baselines with equal budgets, measure all\n"
      "on the held-out cameras and novel sequences, at an eighth, a quarter, half and all of the budget, and find "
      "those\n"
      "that no other beats. Writes pareto.json and report.html; stopped or killed, the same command goes on.\n"
      "With --chart: only draws the main chart of a pareto.json");
  auto options = std::make_shared<ParetoOptions>();
  add_study_options(*command, options->choice);
  command->get_option("--data")->required(false);
  command->get_option("--body")->required(false);
  command->add_option(
      "--grid", options->grid,
      "JSON of what to vary around --config: {\"sweep\": {\"net.resolution\": [128, 512]}} varies each key "
      "by itself,\n"
      "{\"points\": [{\"name\": \"fast\", \"set\": {\"net.resolution\": 128, \"net.width\": 0.25}}]} "
      "several together\n"
      "(default: resolution, width, biases, encoders, image scale, views a step, antialiasing)");
  command
      ->add_option("--baselines", options->baselines,
                   fmt::format("Folder of configs to compare with (default: {} where it is)", baseline_folder))
      ->check(CLI::ExistingDirectory);
  CLI::Option* chart = command->add_option("--chart", options->chart, "pareto.json to draw as --out FILE.svg");
  command->add_option("--measure", options->measure, "What --chart shows")->capture_default_str()->needs(chart);
  command
      ->add_option("--capture", options->capture,
                   "What it was measured on: view, or 'novel NAME' (default: the last one)")
      ->needs(chart);
  command->callback([options] { options->chart.empty() ? sweep(*options) : draw_chart(*options); });
}

}  // namespace degas
