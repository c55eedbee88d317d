#pragma once

#include "model/cli/metric_options.h"
#include "model/cli/shared_options.h"
#include "model/study/study_runner.h"

namespace degas {

/// What commands that train many variants have in common.
struct StudyChoice {
  std::filesystem::path data, body, config = "configs/quick.json", output;
  std::vector<std::filesystem::path> novel, novel_codes;
  bool fit_poses = false;
  std::vector<std::string> overrides;
  std::string hold_out;
  std::optional<double> minutes;
  std::optional<int64_t> iterations;
  int seeds = 1;
  MetricChoice metrics;
  CaptureChoice capture;
  DeviceChoice device;

  /// --config with --set on top. Error as load_config.
  Variant base() const;
  /// Pictures are measured at the base's scale.
  StudySetup setup(const Variant& base) const;
};
void add_study_options(CLI::App& command, StudyChoice& choice);

/// run_study with a progress bar, Ctrl-C and SIGTERM; says at the end how it ended. Throws Error when a variant could
/// not be trained, after all the others.
void run_and_tell(StudySetup setup, const std::vector<Variant>& variants,
                  const std::function<void(const StudyResult&)>& changed);

}  // namespace degas
