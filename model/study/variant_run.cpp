#include "model/study/variant_run.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "model/data/corrupted_capture.h"
#include "model/study/json_file.h"
#include "model/study/recorded_command.h"
#include "model/study/run_evaluation.h"
#include "model/study/version.h"
#include "model/train/training_run.h"

namespace degas {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr double evaluation_share = 0.1;  // of a variant's progress

void add_peak_memory(json& state, double mebibytes) {
  state["memory_mib"] = std::max(state.value("memory_mib", 0.0), mebibytes);
}

}  // namespace

VariantRun::VariantRun(const StudySetup& setup, const Variant& variant, int seed)
    : setup_(setup),
      variant_(variant),
      seed_(seed),
      folder_(variant_folder(setup, variant, seed)),
      run_folder_(folder_ / "run"),
      config_(variant.config) {
  config_.data.hold_out = setup.hold_out;
  config_.train.iterations = setup.budget.step_limit();
  config_.train.seed = static_cast<uint64_t>(seed);
  state_ = read_json_if_any(folder_ / "times.json");
  if (state_.is_null()) state_ = {{"times", json::array()}};
}

json VariantRun::plan() const {
  json plan = {{"config", json::parse(config_text(config_))},
               {"data", setup_.data.string()},
               {"body", setup_.body.string()},
               {"milestones", setup_.milestones}};
  if (setup_.budget.minutes) plan["minutes"] = *setup_.budget.minutes;
  if (setup_.tune != TuneMode::Off) plan["tune"] = option_word(setup_.tune);
  if (setup_.device.kernel_set) plan["kernels"] = option_word(*setup_.device.kernel_set);
  if (!setup_.capture.poses.empty()) plan["poses"] = setup_.capture.poses.string();
  if (!setup_.metrics.empty()) plan["metrics"] = setup_.metrics;
  for (const StudyEvaluation& evaluation : setup_.evaluations())
    plan["evaluations"].push_back({evaluation.name, evaluation.data.string(), evaluation.codes.string()});
  return plan;
}

void VariantRun::require_same_plan() const {
  const json before = read_json_if_any(folder_ / "plan.json");
  if (before.is_null()) return;
  const json now = plan();
  std::vector<std::string> differences;
  json keys = before;
  keys.update(now);
  for (const auto& [key, ignored] : keys.items()) {
    if (key != "config" && before.value(key, json()) != now.value(key, json()))
      differences.push_back(
          fmt::format("{} ({} / {})", key, before.value(key, json()).dump(), now.value(key, json()).dump()));
  }
  if (before.value("config", json()) != now["config"]) {
    for (const std::string& text :
         config_differences(parse_config(before.at("config").dump(), (folder_ / "plan.json").string()), config_))
      differences.push_back(text);
  }
  if (differences.empty()) return;
  throw Error::format("{}: was made by another plan: {}; give the same again, or another --out", folder_.string(),
                      fmt::join(differences, ", "));
}

json VariantRun::finished_record() const {
  const json record = read_json_if_any(folder_ / "record.json");
  require_same_plan();
  return record;
}

std::string VariantRun::train_command() const {
  std::vector<std::string> words = {"train",
                                    "--data",
                                    setup_.data.string(),
                                    "--body",
                                    setup_.body.string(),
                                    "--config",
                                    variant_.config_file.string()};
  const auto add = [&](const std::string& option, const std::string& value) {
    words.insert(words.end(), {option, value});
  };
  for (const std::string& assignment : variant_.overrides) add("--set", assignment);
  add("--hold-out", fmt::format("{}", fmt::join(setup_.hold_out, ",")));
  if (setup_.budget.minutes) add("--minutes", fmt::format("{:g}", *setup_.budget.minutes));
  add("--iterations", std::to_string(setup_.budget.step_limit()));
  add("--seed", std::to_string(seed_));
  if (!setup_.capture.poses.empty()) add("--poses", setup_.capture.poses.string());
  if (!setup_.capture.codes.empty()) add("--codes", setup_.capture.codes.string());
  for (const std::string& word : shared_words(setup_)) words.push_back(word);
  add("--out", run_folder_.string());
  return command_text(words);
}

double VariantRun::minutes_by_history() const {
  // Seconds begin again at 0 in each call; a killed call's lines after its checkpoint have been dropped.
  double seconds = 0, last = 0;
  std::ifstream stream(run_folder_ / "history.jsonl");
  for (std::string line; std::getline(stream, line);) {
    const json row = json::parse(line, nullptr, false);
    const double now = row.is_object() ? row.value("seconds", 0.0) : last;
    if (now < last) seconds += last;
    last = now;
  }
  return (seconds + last) / 60;
}

bool VariantRun::train_to(double fraction, const Progress& progress) {
  CaptureOptions options = setup_.capture;
  options.image_scale = config_.data.image_scale;
  const auto capture = corrupted(open_capture(setup_.data, options), config_.data.corruption);
  Device device(setup_.device);
  TrainingRun run(device, config_, *capture, run_folder_, setup_.body, true, setup_.tune);
  Trainer& trainer = run.trainer();
  const auto reached = [&] {
    const double spent = setup_.budget.minutes
                             ? trainer.minutes_spent() / *setup_.budget.minutes
                             : static_cast<double>(trainer.step()) / static_cast<double>(setup_.budget.iterations);
    return spent >= fraction;
  };
  double loss = 0;
  json& row = state_["training"];
  trainer.run({setup_.budget.step_limit(), setup_.budget.minutes,
               [&] { return setup_.stop_requested() || (fraction < 1 && reached()); }},
              [&](const TrainingReport& report) {
                row["dead_texels"] = report.dead_texels;
                row["exploded_texels"] = report.exploded_texels;
                if (report.losses.count("loss")) loss = report.losses.at("loss");
                progress(
                    (1 - evaluation_share) * report.fraction,
                    fmt::format("step {}  loss {:.4f}  {:.2f} steps/s", report.step, loss, report.steps_per_second));
              });
  row["skipped_steps"] = trainer.skipped_steps();
  row["steps"] = trainer.step();
  row["minutes"] = setup_.budget.minutes ? trainer.minutes_spent() : minutes_by_history();
  row["parameters"] = trainer.avatar().network().parameters().count();
  row["gaussians"] = trainer.avatar().gaussian_count();
  row["device"] = device.description().name;
  row["driver"] = fmt::format("{}, {}", device.description().version, device.description().driver);
  row["pictures"] = capture->picture_identity();
  add_peak_memory(row, std::round(static_cast<double>(device.memory_statistics().peak_bytes_in_use) / (1 << 20)));
  write_json(folder_ / "times.json", state_);
  return !setup_.stop_requested() || reached();
}

json VariantRun::evaluate(const fs::path& folder, bool is_last, const Progress& progress) {
  const json& training = state_["training"];
  const RunEvaluations found =
      evaluate_run(setup_, {run_folder_, training["pictures"].get<std::string>(), is_last}, folder,
                   [&](double share, const std::string& text) {
                     progress(is_last ? 1 - evaluation_share * (1 - share) : -1,
                              fmt::format("after {:.1f} minutes, {}", training["minutes"].get<double>(), text));
                   });
  add_peak_memory(state_, found.memory_mib);
  return found.by_name;
}

json VariantRun::finish(const Progress& progress) {
  require_same_plan();
  write_json(folder_ / "plan.json", plan());
  double shown = 0;  // evaluations on the way leave the bar where it is
  const Progress show = [&](double fraction, const std::string& text) {
    if (fraction >= 0) shown = fraction;
    progress(shown, text);
  };
  json evaluations;
  json& times = state_["times"];
  while (times.size() < setup_.milestones.size()) {
    const double milestone = setup_.milestones[times.size()];
    const bool is_last = times.size() + 1 == setup_.milestones.size();
    if (!train_to(milestone, show) || setup_.stop_requested()) return {};
    const fs::path folder = is_last ? folder_ : folder_ / fmt::format("at_{:g}", milestone);
    evaluations = evaluate(folder, is_last, show);
    json time = {
        {"fraction", milestone}, {"minutes", state_["training"]["minutes"]}, {"steps", state_["training"]["steps"]}};
    for (const auto& [name, found] : evaluations.items()) time["curve"][name] = found["curve"];
    times.push_back(time);
    if (!is_last) write_json(folder_ / "times.json", state_);
  }
  json record = {{"name", variant_.name},
                 {"baseline", variant_.is_baseline},
                 {"seed", seed_},
                 {"config_file", variant_.config_file.string()},
                 {"overrides", variant_.overrides},
                 {"config", json::parse(config_text(config_))},
                 {"command", train_command()},
                 {"budget", setup_.budget.text()},
                 {"commit", version()},
                 {"training", state_["training"]},
                 {"memory_mib", state_["memory_mib"]},
                 {"times", times}};
  for (const auto& [name, found] : evaluations.items()) {
    for (const char* key : {"metrics", "folder", "command"}) record["evaluations"][name][key] = found[key];
  }
  write_json(folder_ / "record.json", record);
  std::error_code ignored;
  fs::remove(RunFolder(run_folder_).previous_checkpoint_file(), ignored);
  fs::remove(folder_ / "times.json", ignored);
  return record;
}

}  // namespace degas
