#include "model/study/study_runner.h"

#include <new>
#include <set>

#include "host/error.h"
#include "model/body/body_model.h"
#include "model/data/selection.h"
#include "model/study/json_file.h"
#include "model/study/run_evaluation.h"
#include "model/study/variant_run.h"
#include "model/train/fitted_poses.h"
#include "model/train/run_lock.h"
#include "model/train/training_views.h"

namespace degas {

namespace fs = std::filesystem;

std::vector<StudyEvaluation> StudySetup::evaluations() const {
  if (!novel_codes.empty() && novel_codes.size() != novel.size()) {
    throw Error::format("--novel-codes: {} given for {} novel sequences; give one for each --novel, in their order",
                        novel_codes.size(), novel.size());
  }
  if (fit_poses && novel.empty())
    throw Error("--fit-poses: poses are fitted of novel sequences, and there is none; name one by --novel");
  std::vector<StudyEvaluation> all = {{"view", data, capture.codes}};
  std::set<std::string> names;
  for (size_t i = 0; i < novel.size(); ++i) {
    const fs::path plain = (novel[i] / "").parent_path();
    const std::string name = "novel " + plain.filename().string();
    if (!names.insert(folder_name(name)).second)
      throw Error::format("--novel {}: a second sequence of this name; rename one", novel[i].string());
    all.push_back({name, novel[i], novel_codes.empty() ? fs::path() : novel_codes[i]});
    if (!fit_poses) continue;
    all.push_back(all.back());
    all.back().name += ", poses fitted";
    all.back().fits_poses = true;
    if (!names.insert(folder_name(all.back().name)).second)
      throw Error::format("--novel {}: its fitted poses would have the name of another sequence; rename one",
                          novel[i].string());
  }
  return all;
}

fs::path variant_folder(const StudySetup& setup, const Variant& variant, int seed) {
  return setup.output / folder_name(variant.name) / fmt::format("seed{}", seed);
}

namespace {

/// Ranges of held-out cameras as names: a novel sequence may lack cameras that a range goes by.
void name_held_out(StudySetup& setup, const Capture& capture) {
  std::vector<std::string> names;
  for (const int camera : selected_cameras(setup.hold_out, capture.camera_names(), "--hold-out"))
    names.push_back(capture.camera_names()[static_cast<size_t>(camera)]);
  setup.hold_out = names;
}

/// What no variant could do with is refused before anything is written.
void require_inputs(StudySetup& setup) {
  Device device(setup.device);
  if (!setup.metrics.empty()) setup.networks(device, {});
  BodyModel::load(setup.body);
  if (setup.hold_out.empty())
    throw Error("--hold-out: no camera is held out to measure on; name one, e.g. --hold-out cam02");
  for (const StudyEvaluation& evaluation : setup.evaluations()) {
    const auto capture = open_evaluation(setup, evaluation);
    if (evaluation.name == "view") name_held_out(setup, *capture);
    evaluation_cameras(setup, evaluation, *capture);
  }
  if (!setup.capture.poses.empty()) warn_of_fitted_cameras(setup.capture.poses, setup.hold_out);
}

}  // namespace

StudyResult run_study(const StudySetup& given, const std::vector<Variant>& variants,
                      const std::function<void(double, const std::string&)>& progress,
                      const std::function<void(const StudyResult&)>& changed) {
  require_distinct(variants);
  StudySetup setup = given;
  require_inputs(setup);
  const RunLock lock(setup.output);
  StudyResult result;
  result.records.assign(variants.size(), std::vector<nlohmann::json>(static_cast<size_t>(setup.seeds)));
  const auto record_of = [&](size_t i, int seed) -> nlohmann::json& {
    return result.records[i][static_cast<size_t>(seed - 1)];
  };
  const double total = static_cast<double>(variants.size()) * setup.seeds;
  double done = 0;
  for (size_t i = 0; i < variants.size(); ++i) {
    for (int seed = 1; seed <= setup.seeds; ++seed) {
      record_of(i, seed) = reading_own_json(variant_folder(setup, variants[i], seed),
                                            [&] { return VariantRun(setup, variants[i], seed).finished_record(); });
      done += !record_of(i, seed).is_null();
    }
  }
  if (done > 0) reading_own_json(setup.output, [&] { changed(result); });
  // Seed by seed, so that a study that is stopped early has compared every variant at least once.
  for (int seed = 1; seed <= setup.seeds; ++seed) {
    for (size_t i = 0; i < variants.size(); ++i) {
      if (!record_of(i, seed).is_null()) continue;
      const std::string title = setup.seeds > 1 ? fmt::format("{}, seed {}", variants[i].name, seed) : variants[i].name;
      const auto show = [&](double fraction, const std::string& text) {
        progress((done + fraction) / total, fmt::format("[{:.0f}/{:.0f}] {}: {}", done + 1, total, title, text));
      };
      try {
        record_of(i, seed) = reading_own_json(variant_folder(setup, variants[i], seed),
                                              [&] { return VariantRun(setup, variants[i], seed).finish(show); });
      } catch (const Error& error) {
        if (!setup.stop_requested()) result.failures.push_back(fmt::format("{}: {}", title, error.what()));
      } catch (const std::bad_alloc&) {
        result.failures.push_back(fmt::format("{}: out of memory", title));
      }
      if (setup.stop_requested() && record_of(i, seed).is_null()) {
        result.is_whole = false;
        return result;
      }
      ++done;
      changed(result);
    }
  }
  return result;
}

}  // namespace degas
