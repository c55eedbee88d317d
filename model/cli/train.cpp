#include <cstdio>
#include <memory>

#include "host/error.h"
#include "model/cli/commands.h"
#include "model/cli/progress.h"
#include "model/cli/shared_options.h"
#include "model/data/corrupted_capture.h"
#include "model/data/selection.h"
#include "model/train/fitted_poses.h"
#include "model/train/stop_signal.h"
#include "model/train/training_run.h"
#include "model/train/training_views.h"

namespace degas {
namespace {

struct TrainOptions {
  std::filesystem::path data, body, config, output;
  std::string hold_out, cameras, frames;
  std::vector<std::string> overrides;
  std::optional<int64_t> iterations;
  std::optional<double> minutes;
  std::optional<uint64_t> seed;
  bool resume = false, profile = false;
  CaptureChoice capture;
  DeviceChoice device;
};

/// The file's config with what the command line says on top of it.
Config config_of(const TrainOptions& options) {
  Config config = load_config(options.config);
  for (const std::string& assignment : options.overrides) apply_override(config, assignment);
  if (!options.hold_out.empty()) config.data.hold_out = selection_parts(options.hold_out);
  if (!options.cameras.empty()) config.data.cameras = selection_parts(options.cameras);
  if (!options.frames.empty()) config.data.frames = selection_parts(options.frames);
  if (options.iterations) config.train.iterations = *options.iterations;
  if (options.seed) config.train.seed = *options.seed;
  validate(config, options.config.string());
  return config;
}

std::string progress_text(const TrainingReport& report) {
  std::string text = fmt::format("step {}  loss {:.4f}  {:.2f} steps/s", report.step,
                                 report.losses.count("loss") ? report.losses.at("loss") : 0.0, report.steps_per_second);
  if (report.validation_psnr) text += fmt::format("  validation {:.2f} dB", *report.validation_psnr);
  if (report.dead_texels > 0) text += fmt::format("  {} dead texels", report.dead_texels);
  if (report.exploded_texels > 0) text += fmt::format("  {} exploded texels", report.exploded_texels);
  if (report.skipped > 0) text += fmt::format("  {} steps skipped", report.skipped);
  return text;
}

void print_profile(Device& device, int64_t steps) {
  const std::vector<Profiler::Row> rows = device.take_profile();
  fmt::print("\n{:<20} {:<40} {:>12} {:>12}\n", "stage", "kernel", "launches/step", "ms/step");
  double total = 0;
  for (const Profiler::Row& row : rows) {
    total += row.milliseconds;
    fmt::print("{:<20} {:<40} {:>12.1f} {:>12.3f}\n",
               fmt::format("{}{}", row.stage.name, row.stage.backward ? " backward" : ""), row.kernel,
               static_cast<double>(row.launches) / static_cast<double>(steps),
               row.milliseconds / static_cast<double>(steps));
  }
  fmt::print("{:<61} {:>12} {:>12.3f}\n", "all", "", total / static_cast<double>(steps));
}

void train(const TrainOptions& options) {
  const Config config = config_of(options);
  const std::unique_ptr<Capture> capture =
      corrupted(open_capture(options.data, options.capture.options(config)), config.data.corruption);
  if (!options.capture.poses.empty())
    warn_of_fitted_cameras(options.capture.poses, with_camera_names(config, *capture).data.hold_out);
  DeviceOptions device_options = options.device.options();
  device_options.profile = options.profile;
  Device device(device_options);
  TrainingRun run(device, config, *capture, options.output, options.body, options.resume, options.device.tune);
  Trainer& trainer = run.trainer();
  fmt::print("{}: {} Gaussians, {} parameters, {} frames x {} cameras, on {}\n",
             run.continues() ? "continuing" : "training", trainer.avatar().gaussian_count(),
             trainer.avatar().network().parameters().count(),
             selected_frames(config.data.frames, capture->frame_count(), "data.frames").size(),
             allowed_cameras(*capture, config.data).size(), device.description().name);

  const int64_t first_step = trainer.step();
  const StopSignal stop;
  Progress progress;
  std::optional<double> validation;
  const TrainingEnd end =
      trainer.run({config.train.iterations, options.minutes, StopSignal::requested}, [&](TrainingReport report) {
        if (report.validation_psnr) validation = report.validation_psnr;
        report.validation_psnr = validation;
        if (!report.skip_cause.empty()) {
          progress.finish();
          print_warning(report.skip_cause);
        }
        progress.show(report.fraction, progress_text(report));
      });
  progress.finish();
  const MemoryPool::Statistics memory = device.memory_statistics();
  fmt::print("device memory: {} MiB at most in use, {} MiB held\n", memory.peak_bytes_in_use >> 20,
             memory.bytes_held >> 20);
  const char* how = end == TrainingEnd::Finished    ? "finished"
                    : end == TrainingEnd::OutOfTime ? "time is up"
                                                    : "interrupted";
  print_tuning(device);
  if (options.profile) print_profile(device, trainer.step() - first_step);
  fmt::print("{} at step {}; saved {} (go on with --resume)\n", how, trainer.step(),
             run.folder().checkpoint_file().string());
}

}  // namespace

void add_train_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "train",
      "Train an avatar on a capture. Writes RUN/config.json, RUN/history.jsonl and RUN/checkpoint.bin; Ctrl-C saves "
      "and\n"
      "stops, --resume goes on with the bits of an uninterrupted run (when the budget is in iterations)");
  auto options = std::make_shared<TrainOptions>();
  command
      ->add_option(
          "--data", options->data,
          "Capture folder in the layout of DREAMS (e.g. PxCy), ActorsHQ, AvatarReX or THuman4, or a file made of\n"
          "one by `degas pack`")
      ->required();
  command->add_option("--body", options->body, "Body model, SMPL-X npz layout")->required();
  command->add_option("--config", options->config, "JSON config, e.g. configs/quick.json")->required();
  command->add_option("--out", options->output, "Run folder")->required();
  command->add_option("--hold-out", options->hold_out, "Cameras training never sees, e.g. cam02 (data.hold_out)");
  command->add_option("--cameras", options->cameras, fmt::format("{} (data.cameras; default: all)", cameras_help));
  command->add_option("--frames", options->frames, frames_help);
  command->add_option("--iterations", options->iterations, "Optimiser steps in all (train.iterations)");
  command
      ->add_option("--minutes", options->minutes,
                   "Stop after so many minutes of training, resumed ones included; the\n"
                   "learning rate follows the clock then")
      ->check(CLI::PositiveNumber);
  command->add_option("--seed", options->seed, "Same seed, same device, same tuning: same bits (train.seed)");
  command->add_option("--set", options->overrides, "Override a config key, e.g. --set net.width=0.5; may be repeated");
  command->add_flag("--resume", options->resume, "Continue RUN's checkpoint; starts anew where there is none");
  command->add_flag("--profile", options->profile, "Print the time of every kernel, launches and milliseconds a step");
  add_capture_options(*command, options->capture);
  add_device_options(*command, options->device);
  command->callback([options] { train(*options); });
}

}  // namespace degas
