#include "model/study/ablation.h"

#include <fmt/ranges.h>

#include "model/study/markdown_table.h"
#include "model/study/measures.h"
#include "model/study/published.h"

namespace degas {
namespace {

using nlohmann::json;

/// The records of a variant that have been made, by seed.
std::vector<const json*> made(const std::vector<json>& records) {
  std::vector<const json*> found;
  for (const json& record : records) {
    if (!record.is_null()) found.push_back(&record);
  }
  return found;
}

json spreads(const std::vector<const json*>& records, const std::string& evaluation) {
  std::map<std::string, std::vector<double>> values;
  for (const json* record : records) {
    for (const auto& [key, value] : record->at("evaluations").at(evaluation).at("metrics").items()) {
      if (value.is_number() && (is_measure(key) || key == "fps")) values[key].push_back(value.get<double>());
    }
  }
  json found = json::object();
  for (const auto& [measure, list] : values) found[measure] = spread_of(list).json();
  return found;
}

json differences(const StudySetup& setup, const std::vector<json>& variant, const std::vector<json>& reference,
                 const std::string& evaluation) {
  std::vector<FrameTable> ours, theirs;
  for (size_t i = 0; i < variant.size(); ++i) {
    if (variant[i].is_null() || reference[i].is_null()) continue;
    const auto read = [&](const json& record) {
      const std::filesystem::path folder = record.at("evaluations").at(evaluation).at("folder").get<std::string>();
      return FrameTable::read(setup.output / folder / "per_frame.csv");
    };
    ours.push_back(read(variant[i]));
    theirs.push_back(read(reference[i]));
  }
  json found = json::object();
  if (ours.empty()) return found;
  for (const auto& [measure, mean] : ours.front().means()) {
    if (const auto difference = paired_difference(ours, theirs, measure)) found[measure] = difference->json();
  }
  return found;
}

json paper_rows(const std::string& study, const Variant& variant) {
  json rows = json::array();
  for (const std::string& label : variant.paper_labels) {
    if (const PublishedRow* row = find_published(study, label))
      rows.push_back({{"label", label}, {"figures", row->figures}, {"data", row->data}});
  }
  return rows;
}

/// A number with its uncertainty where there is one.
std::string with_error(const std::string& measure, const json& value, const char* error, bool with_sign) {
  std::string text = measure_text(measure, value.at("mean").get<double>(), with_sign);
  if (value.contains(error)) text += " ±" + measure_text(measure, value.at(error).get<double>());
  return text;
}

/// Steps that were skipped in all runs; empty where one does not tell.
std::string skipped_text(const json& runs) {
  int64_t skipped = 0;
  for (const json& run : runs) {
    if (!run.at("training").contains("skipped_steps")) return "";
    skipped += run.at("training").at("skipped_steps").get<int64_t>();
  }
  return std::to_string(skipped);
}

std::string training_text(const json& runs, int seeds) {
  std::vector<std::string> steps;
  for (const json& run : runs) steps.push_back(std::to_string(run.at("training").at("steps").get<int64_t>()));
  // Under a budget in steps all seeds have as many.
  const bool is_one = std::adjacent_find(steps.begin(), steps.end(), std::not_equal_to<>()) == steps.end();
  std::string text = is_one ? steps.front() : fmt::format("{}", fmt::join(steps, ", "));
  if (static_cast<int>(steps.size()) < seeds) text += fmt::format(" ({} of {} seeds)", steps.size(), seeds);
  return text;
}

std::string result_table(const json& variants, const std::string& evaluation, const std::vector<std::string>& measures,
                         int seeds) {
  const bool has_paper =
      std::any_of(variants.begin(), variants.end(), [](const json& v) { return !v["paper"].empty(); });
  std::vector<std::vector<std::string>> rows = {{evaluation}};
  for (const std::string& measure : measures) rows[0].push_back(measure_label(measure));
  rows[0].insert(rows[0].end(), {"frames/s", "steps"});
  const bool has_seeds =
      std::any_of(variants.begin(), variants.end(), [](const json& v) { return v["runs"].size() > 2; });
  if (has_seeds) rows[0].insert(rows[0].end(), {"PSNR, worst seed minus median", "steps skipped"});
  if (has_paper) rows[0].push_back("paper: DREAMS-Avatar");
  for (const json& variant : variants) {
    const json& values = variant["evaluations"][evaluation]["spread"];
    std::vector<std::string> row = {variant["name"].get<std::string>()};
    for (const std::string& measure : measures)
      row.push_back(values.contains(measure) ? with_error(measure, values[measure], "deviation", false) : "");
    row.push_back(values.contains("fps") ? fmt::format("{:.1f}", values["fps"]["mean"].get<double>()) : "");
    row.push_back(training_text(variant["runs"], seeds));
    if (has_seeds) {
      row.push_back(values.contains("psnr")
                        ? measure_text("psnr",
                                       values["psnr"]["lowest"].get<double>() - values["psnr"]["median"].get<double>(),
                                       true)
                        : "");
      row.push_back(skipped_text(variant["runs"]));
    }
    std::vector<std::string> paper;
    for (const json& published : variant["paper"]) {
      std::string text = published["label"].get<std::string>();
      for (const char* measure : {"psnr", "aed", "cross_aed"}) {
        if (published["figures"].contains(measure))
          text += fmt::format(" {} {}", measure_label(measure),
                              measure_text(measure, published["figures"][measure].get<double>()));
      }
      paper.push_back(text);
    }
    if (has_paper) row.push_back(fmt::format("{}", fmt::join(paper, "; ")));
    rows.push_back(row);
  }
  return markdown_table(rows);
}

std::string difference_table(const json& variants, const std::string& evaluation,
                             const std::vector<std::string>& measures) {
  std::vector<std::vector<std::string>> rows = {
      {fmt::format("{}, minus {}", evaluation, variants[0]["name"].get<std::string>())}};
  for (const std::string& measure : measures) rows[0].push_back(measure_label(measure));
  rows[0].push_back("pictures better, PSNR");
  for (size_t i = 1; i < variants.size(); ++i) {
    const json& values = variants[i]["evaluations"][evaluation]["difference"];
    std::vector<std::string> row = {variants[i]["name"].get<std::string>()};
    for (const std::string& measure : measures)
      row.push_back(values.contains(measure) ? with_error(measure, values[measure], "standard_error", true) : "");
    row.push_back(values.contains("psnr") ? fmt::format("{:.0f} %", 100 * values["psnr"]["share_better"].get<double>())
                                          : "");
    rows.push_back(row);
  }
  return rows.size() > 1 ? markdown_table(rows) : std::string();
}

}  // namespace

json ablation_json(const std::string& study, const StudySetup& setup, const std::vector<Variant>& variants,
                   const StudyResult& result) {
  json ablation = {{"study", study},
                   {"data", setup.data.string()},
                   {"hold_out", setup.hold_out},
                   {"budget", setup.budget.text()},
                   {"seeds", setup.seeds},
                   {"failures", result.failures},
                   {"variants", json::array()}};
  for (const StudyEvaluation& evaluation : setup.evaluations()) ablation["measured_on"].push_back(evaluation.name);
  for (size_t i = 0; i < variants.size(); ++i) {
    const std::vector<const json*> records = made(result.records[i]);
    if (records.empty()) continue;
    json entry = {{"name", variants[i].name}, {"paper", paper_rows(study, variants[i])}, {"runs", json::array()}};
    for (const json* record : records) entry["runs"].push_back(*record);
    for (const StudyEvaluation& evaluation : setup.evaluations()) {
      entry["evaluations"][evaluation.name] = {
          {"spread", spreads(records, evaluation.name)},
          {"difference", differences(setup, result.records[i], result.records[0], evaluation.name)}};
    }
    ablation["variants"].push_back(entry);
  }
  return ablation;
}

std::string ablation_markdown(const json& ablation) {
  const json& variants = ablation.at("variants");
  if (variants.empty()) return "";
  const json& first = variants[0]["runs"][0];
  std::string text = fmt::format("# Study: {}\n\n{}, {} for each variant and seed, {} seed{}. {} ({}), commit {}.\n",
                                 ablation.at("study").get<std::string>(), ablation.at("data").get<std::string>(),
                                 ablation.at("budget").get<std::string>(), ablation.at("seeds").get<int>(),
                                 ablation.at("seeds") == 1 ? "" : "s", first["training"]["device"].get<std::string>(),
                                 first["training"]["driver"].get<std::string>(), first["commit"].get<std::string>());
  for (const json& capture : ablation.at("measured_on")) {
    const std::string name = capture.get<std::string>();
    const std::vector<std::string> measures = shown_measures(first["evaluations"][name]["metrics"]);
    text += "\n" + result_table(variants, name, measures, ablation.at("seeds").get<int>());
    const std::string differences = difference_table(variants, name, measures);
    if (!differences.empty()) text += "\n" + differences;
  }
  text +=
      "\n± of a figure: standard deviation over seeds (one seed: none). ± of a difference, taken picture by picture: "
      "standard error of its mean by ten batches of consecutive frames; it does not hold what another seed would "
      "change. The paper's figures are of another capture and another training.\n";
  for (const json& failure : ablation.at("failures")) text += "\nNot trained: " + failure.get<std::string>() + "\n";
  return text;
}

}  // namespace degas
