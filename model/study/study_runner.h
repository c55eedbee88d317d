#pragma once

#include <functional>

#include "host/device/device.h"
#include "host/device/tuning_table.h"
#include "model/data/capture.h"
#include "model/study/variant.h"
#include "model/train/evaluator.h"

namespace degas {

/// A capture that every variant is measured on.
struct StudyEvaluation {
  std::string name;  ///< "view"; or "novel", the capture's name, and whether its poses are fitted
  std::filesystem::path data, codes;
  bool fits_poses = false;  ///< to the cameras that are not held out (PoseFitter), before it is measured
};

struct StudySetup {
  std::filesystem::path data, body, output;
  std::vector<std::filesystem::path> novel, novel_codes;  ///< codes: as many as captures, or none
  bool fit_poses = false;                                 ///< measure novel sequences with fitted poses, too
  /// Its image_scale is that of evaluation, for every variant; its poses and codes are of `data` alone.
  CaptureOptions capture;
  DeviceOptions device;
  TuneMode tune = TuneMode::Off;
  /// What evaluations measure by; `metrics` names what is beyond the default, as options of `degas eval`.
  std::function<MetricNetworks(Device&, const LossConfig&)> networks = [](Device&, const LossConfig& loss) {
    return default_metric_networks(loss);
  };
  std::vector<std::string> metrics;
  std::vector<std::string> hold_out;
  StudyBudget budget;
  int seeds = 1;
  std::vector<double> milestones = {1};  ///< fractions of the budget at which it is evaluated; ascending, the last 1
  std::function<bool()> stop_requested = [] { return false; };

  /// "view" on the held-out cameras, then the novel sequences, each as registered and then fitted. Error when two have
  /// the same name.
  std::vector<StudyEvaluation> evaluations() const;
};

/// Where a variant's files of a seed lie.
std::filesystem::path variant_folder(const StudySetup& setup, const Variant& variant, int seed);

struct StudyResult {
  /// By variant, then seed from 1: record.json as run_study writes it; null where it has not been made.
  std::vector<std::vector<nlohmann::json>> records;
  std::vector<std::string> failures;  ///< "VARIANT, seed N: why", of variants that could not be trained
  bool is_whole = true;               ///< false where it was stopped
};

/// Trains every variant with every seed by the same budget, and evaluates it on the held-out cameras and the novel
/// sequences. Below setup.output: VARIANT/seedN/ with run/ (as `degas train` makes it), an evaluation's folder each (as
/// `degas eval` makes it), plan.json and record.json.
///
/// May be stopped or killed at any moment: what has a record.json is not run again, what was half-trained goes on from
/// its checkpoint for what is left of its budget. A variant that cannot be trained (too large for the device) is told
/// of in the result, and the others go on. All is done in this one process, by the same Trainer and evaluate as the
/// commands', on a Device of its own for each training and each evaluation: so that the memory measured is theirs, and
/// going on after an evaluation is the same as going on after a kill.
///
/// changed: called with what there is whenever a variant was done with. Throws Error for inputs that no variant could
/// use, for a plan.json of another plan, and where another process runs a study into the folder.
StudyResult run_study(const StudySetup& setup, const std::vector<Variant>& variants,
                      const std::function<void(double fraction, const std::string& text)>& progress,
                      const std::function<void(const StudyResult&)>& changed);

}  // namespace degas
