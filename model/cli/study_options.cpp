#include "model/cli/study_options.h"

#include <fmt/ranges.h>

#include "host/error.h"
#include "model/cli/progress.h"
#include "model/data/selection.h"
#include "model/train/stop_signal.h"

namespace degas {

Variant StudyChoice::base() const {
  return make_variant(config.stem().string(), config, overrides);
}

StudySetup StudyChoice::setup(const Variant& base) const {
  StudySetup setup;
  setup.data = data;
  setup.body = body;
  setup.output = output;
  setup.novel = novel;
  setup.novel_codes = novel_codes;
  setup.fit_poses = fit_poses;
  setup.capture = capture.options(base.config);
  setup.device = device.options();
  setup.tune = device.tune.value_or(TuneMode::Off);
  setup.hold_out = hold_out.empty() ? base.config.data.hold_out : selection_parts(hold_out);
  setup.budget.minutes = minutes;
  setup.budget.iterations = iterations.value_or(base.config.train.iterations);
  setup.seeds = seeds;
  setup.metrics = metrics.words();
  setup.networks = [metrics = metrics](Device& device, const LossConfig& loss) {
    return metrics.networks(device, loss);
  };
  return setup;
}

void add_study_options(CLI::App& command, StudyChoice& choice) {
  command.add_option("--data", choice.data, "Capture to train on")->required();
  command.add_option("--body", choice.body, "Body model, SMPL-X npz layout")->required();
  command.add_option("--hold-out", choice.hold_out,
                     "Cameras that training never sees and that are measured on (default: the config's)");
  command.add_option("--novel", choice.novel, "Sequence that training never sees, to measure on too; may be repeated");
  command.add_option("--novel-codes", choice.novel_codes,
                     "Where its face codes lie, see --codes; one for each --novel (default: in it)");
  command.add_flag(
      "--fit-poses", choice.fit_poses,
      "Measure novel sequences twice: as registered, and with poses fitted to the cameras that are not held\n"
      "out, as fit-poses does it, so that the avatar is measured rather than the tracker");
  command.add_option("--config", choice.config, "Config that all is compared with")->capture_default_str();
  command.add_option("--set", choice.overrides, "Override a key of it, for every variant; may be repeated");
  CLI::Option* minutes = command
                             .add_option("--minutes", choice.minutes,
                                         "Minutes of training for each variant and seed, evaluations not counted")
                             ->check(CLI::PositiveNumber);
  command.add_option("--iterations", choice.iterations, "Optimiser steps instead (default: the config's)")
      ->check(CLI::Range(int64_t{1}, int64_t{1} << 40))
      ->excludes(minutes);
  command.add_option("--seeds", choice.seeds, "Seeds 1 to N for each variant")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  command.add_option("--out", choice.output, "Folder of all runs; the same command goes on where it was stopped");
  add_metric_options(command, choice.metrics);
  add_capture_options(command, choice.capture);
  add_device_options(command, choice.device);
}

void run_and_tell(StudySetup setup, const std::vector<Variant>& variants,
                  const std::function<void(const StudyResult&)>& changed) {
  const StopSignal stop;
  setup.stop_requested = StopSignal::requested;
  Progress progress;
  const StudyResult result = run_study(
      setup, variants, [&](double fraction, const std::string& text) { progress.show(fraction, text); }, changed);
  progress.finish();
  if (!result.is_whole) {
    fmt::print("interrupted; the same command goes on\n");
    return;
  }
  if (!result.failures.empty()) {
    throw Error::format("{} of {} runs could not be made: {}", result.failures.size(),
                        variants.size() * static_cast<size_t>(setup.seeds), fmt::join(result.failures, "; "));
  }
}

}  // namespace degas
