#include <memory>

#include "host/device/tuner.h"
#include "host/error.h"
#include "model/cli/commands.h"
#include "model/cli/driven_run.h"
#include "model/cli/metric_options.h"
#include "model/cli/progress.h"
#include "model/data/selection.h"
#include "model/train/evaluator.h"
#include "model/train/fitted_poses.h"
#include "model/train/stop_signal.h"

namespace degas {
namespace {

struct EvalOptions {
  std::filesystem::path run, data, output, pictures, truth;
  std::string cameras, frames;
  MetricChoice metrics;
  CaptureChoice capture;
  DeviceChoice device;
};

void print_figures(const EvaluationSummary& summary) {
  if (summary.without_face > 0)
    fmt::print("{} pictures do not show the head: not in the face figures\n", summary.without_face);
  for (const auto& [key, value] : summary.metrics.items()) {
    if (value.is_number_float()) fmt::print("{:<18} {:.4f}\n", key, value.get<double>());
    if (value.is_null()) fmt::print("{:<18} -\n", key);
  }
}

EvaluationOptions evaluation_of(const EvalOptions& options, Device& device, const LossConfig& loss) {
  EvaluationOptions evaluation;
  evaluation.output = options.output;
  evaluation.networks = options.metrics.networks(device, loss);
  evaluation.stop_requested = StopSignal::requested;
  return evaluation;
}

EvaluationProgress shown_by(Progress& progress) {
  return [&](int done, int total) {
    progress.show(static_cast<double>(done) / total, fmt::format("picture {} of {}", done, total));
  };
}

std::vector<std::string> names_of(const std::vector<int>& cameras, const Capture& capture) {
  std::vector<std::string> names;
  for (const int camera : cameras) names.push_back(capture.camera_names()[static_cast<size_t>(camera)]);
  return names;
}

void evaluate_run(const EvalOptions& options) {
  DrivenRun run(options.run, options.data, options.capture, options.device);
  Device& device = run.device;
  TrainedAvatar& avatar = run.avatar;
  const Capture& capture = *run.capture;
  EvaluationOptions evaluation = evaluation_of(options, device, avatar.config().loss);
  const std::vector<std::string>& held_out = avatar.config().data.hold_out;
  const std::vector<std::string> cameras = options.cameras.empty() ? held_out : selection_parts(options.cameras);
  evaluation.cameras = selected_cameras(cameras, capture.camera_names(), "--cameras");
  std::unique_ptr<Capture> as_recorded;
  if (!options.capture.poses.empty()) {
    warn_of_fitted_cameras(options.capture.poses, names_of(evaluation.cameras, capture));
    CaptureChoice own = options.capture;
    own.poses.clear();
    as_recorded = open_capture(options.data, own.options(avatar.config()));
    evaluation.boxes = as_recorded.get();
  }
  evaluation.frames = selected_frames(selection_parts(options.frames), capture.frame_count(), "--frames");

  const StopSignal stop;
  Progress progress;
  const EvaluationSummary summary = evaluate(device, avatar, capture, evaluation, shown_by(progress));
  progress.finish();
  if (summary.refined_pictures > 0) {
    fmt::print("{} of {} pictures are of frames whose pose training refined: drawn with the refined pose\n",
               summary.refined_pictures, summary.pictures);
  }
  if (summary.refined_pictures == 0 && avatar.has_refined_poses()) {
    fmt::print(
        "registered poses are used; training refined poses of another sequence (or this one's files or --poses have "
        "changed since)\n");
  }
  if (summary.without_picture > 0)
    fmt::print("{} frames and cameras have no picture: left out\n", summary.without_picture);
  print_figures(summary);
  print_tuning(device);
}

void evaluate_given(const EvalOptions& options) {
  Device device(options.device.options());
  set_tuner(device, options.device.tune.value_or(TuneMode::Off));
  const EvaluationOptions evaluation = evaluation_of(options, device, {});
  std::error_code ignored;
  if (std::filesystem::equivalent(options.output, options.truth, ignored)) {
    throw Error::format("--out {}: is --truth, whose figures would be lost; name another folder",
                        options.output.string());
  }
  const StopSignal stop;
  Progress progress;
  const EvaluationSummary summary =
      evaluate_pictures(device, options.pictures, EvaluationFolder(options.truth), evaluation, shown_by(progress));
  progress.finish();
  print_figures(summary);
  print_tuning(device);
}

void run_eval(const EvalOptions& options) {
  if (!options.pictures.empty()) {
    evaluate_given(options);
  } else if (!options.run.empty()) {
    evaluate_run(options);
  } else {
    throw Error(
        "eval: name --run and --data to draw and measure an avatar, or --pictures and --truth to measure files");
  }
  fmt::print("wrote {}\n", (options.output / "metrics.json").string());
}

}  // namespace

void add_eval_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "eval",
      "Measure a trained avatar, or pictures drawn by anything, against a capture's pictures: PSNR, SSIM, LPIPS, FID\n"
      "on the full image, the person's, the face's and the mouth's box, and AED, over white. Writes metrics.json,\n"
      "per_frame.csv, worst.png, boxes.json, truth/, render/ and sheets/ with the error");
  auto options = std::make_shared<EvalOptions>();
  CLI::Option* data =
      command->add_option("--data", options->data, "Capture to measure on: the trained one, or a novel sequence");
  CLI::Option* run = command->add_option("--run", options->run, "Run folder of `degas train`")->needs(data);
  CLI::Option* truth =
      command->add_option("--truth", options->truth,
                          "Folder of an earlier `degas eval`: its photographs and boxes are what --pictures meet");
  CLI::Option* pictures =
      command
          ->add_option("--pictures", options->pictures,
                       "Instead of --run: a folder of pictures to measure, named as in the other's truth/")
          ->needs(truth)
          ->excludes(run)
          ->excludes(data);
  command
      ->add_option("--cameras", options->cameras,
                   fmt::format("{} (default: the held-out ones, else all)", cameras_help))
      ->excludes(pictures);
  command->add_option("--frames", options->frames, frames_help)->excludes(pictures);
  command->add_option("--out", options->output, "Folder to write")->required();
  add_metric_options(*command, options->metrics);
  add_capture_options(*command, options->capture);
  add_device_options(*command, options->device);
  command->callback([options] { run_eval(*options); });
}

}  // namespace degas
