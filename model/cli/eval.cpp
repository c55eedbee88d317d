#include <memory>

#include "host/device/tuner.h"
#include "host/error.h"
#include "model/cli/commands.h"
#include "model/cli/progress.h"
#include "model/cli/shared_options.h"
#include "model/data/selection.h"
#include "model/train/evaluator.h"
#include "model/train/stop_signal.h"

namespace degas {
namespace {

struct EvalOptions {
  std::filesystem::path run, data, output;
  std::string cameras, frames;
  CaptureChoice capture;
  DeviceChoice device;
};

void evaluate_run(const EvalOptions& options) {
  Device device(options.device.options());
  set_tuner(device, options.device.tune.value_or(TuneMode::Off));
  TrainedAvatar avatar(device, RunFolder(options.run));
  const std::unique_ptr<Capture> capture = open_capture(options.data, options.capture.options(avatar.config()));
  EvaluationOptions evaluation;
  const std::vector<std::string>& held_out = avatar.config().data.hold_out;
  const std::vector<std::string> cameras = options.cameras.empty() ? held_out : selection_parts(options.cameras);
  evaluation.cameras = selected_cameras(cameras, capture->camera_names(), "--cameras");
  evaluation.frames = selected_frames(selection_parts(options.frames), capture->frame_count(), "--frames");
  evaluation.output = options.output;
  evaluation.stop_requested = StopSignal::requested;

  const StopSignal stop;
  Progress progress;
  const EvaluationSummary summary = evaluate(device, avatar, *capture, evaluation, [&](int done, int total) {
    progress.show(static_cast<double>(done) / total, fmt::format("picture {} of {}", done, total));
  });
  progress.finish();
  if (summary.refined_pictures > 0) {
    fmt::print("{} of {} pictures are of frames whose pose training refined: drawn with the refined pose\n",
               summary.refined_pictures, summary.pictures);
  }
  if (summary.refined_pictures == 0 && avatar.has_refined_poses()) {
    fmt::print(
        "training refined poses of another sequence (or this one's files changed since): registered poses are used\n");
  }
  if (summary.without_picture > 0)
    fmt::print("{} frames and cameras have no picture: left out\n", summary.without_picture);
  if (summary.without_face > 0)
    fmt::print("{} pictures do not show the head: not in the face figures\n", summary.without_face);
  for (const char* key :
       {"psnr", "ssim", "lpips", "face_psnr", "face_ssim", "face_lpips", "decode_ms", "render_ms", "fps"}) {
    const nlohmann::json& value = summary.metrics.at(key);
    fmt::print("{:<12} {}\n", key, value.is_null() ? std::string("-") : fmt::format("{:.4f}", value.get<double>()));
  }
  print_tuning(device);
  fmt::print("wrote {}\n", (options.output / "metrics.json").string());
}

}  // namespace

void add_eval_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "eval",
      "Measure a trained avatar against a capture's pictures: PSNR, SSIM, LPIPS on the full image, the person's box "
      "and the\n"
      "face box, over white. Writes metrics.json, per_frame.csv, truth/, render/ and sheets/ with the error");
  auto options = std::make_shared<EvalOptions>();
  command->add_option("--run", options->run, "Run folder of `degas train`")->required();
  command->add_option("--data", options->data, "Capture to measure on: the trained one, or a novel sequence")
      ->required();
  command->add_option("--cameras", options->cameras,
                      fmt::format("{} (default: the held-out ones, else all)", cameras_help));
  command->add_option("--frames", options->frames, frames_help);
  command->add_option("--out", options->output, "Folder to write")->required();
  add_capture_options(*command, options->capture);
  add_device_options(*command, options->device);
  command->callback([options] { evaluate_run(*options); });
}

}  // namespace degas
