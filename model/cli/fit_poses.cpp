#include <algorithm>
#include <memory>

#include "host/error.h"
#include "model/cli/commands.h"
#include "model/cli/driven_run.h"
#include "model/cli/progress.h"
#include "model/data/selection.h"
#include "model/train/fitted_poses.h"
#include "model/train/stop_signal.h"

namespace degas {
namespace {

struct FitOptions {
  std::filesystem::path run, data, output;
  std::string cameras, frames;
  int steps = PoseFitOptions().steps;
  bool resume = false;
  CaptureChoice capture;
  DeviceChoice device;
};

/// The named cameras, or those that training used.
std::vector<int> cameras_of(const FitOptions& options, const TrainedAvatar& avatar, const Capture& capture) {
  if (options.cameras.empty()) return avatar.seen_cameras(capture);
  const std::vector<std::string>&names = capture.camera_names(), &held_out = avatar.config().data.hold_out;
  const std::vector<int> cameras = selected_cameras(selection_parts(options.cameras), names, "--cameras");
  for (const int camera : cameras) {
    const std::string& name = names[static_cast<size_t>(camera)];
    if (std::find(held_out.begin(), held_out.end(), name) == held_out.end()) continue;
    print_warning(
        fmt::format("{} was held out from training: after this, what is measured on it is no longer unseen", name));
  }
  return cameras;
}

void fit(const FitOptions& options) {
  if (!options.resume && std::filesystem::is_regular_file(options.output)) {
    throw Error::format("{}: is there already; go on with it by --resume, or name another --out",
                        options.output.string());
  }
  DrivenRun run(options.run, options.data, options.capture, options.device);
  Device& device = run.device;
  TrainedAvatar& avatar = run.avatar;
  const Capture& capture = *run.capture;
  PoseFitOptions fitting;
  fitting.cameras = cameras_of(options, avatar, capture);
  fitting.steps = options.steps;
  fitting.stop_requested = StopSignal::requested;
  const std::vector<int> frames = selected_frames(selection_parts(options.frames), capture.frame_count(), "--frames");
  FittedPoses poses(options.output, avatar, capture, fitting);
  if (options.resume) poses.resume();

  PoseFitter fitter(device, avatar, capture, fitting);
  const StopSignal stop;
  Progress progress;
  const bool is_whole = fit_frames(fitter, poses, frames, [&](int done, const FittedPose& fitted) {
    progress.show(static_cast<double>(done) / static_cast<double>(frames.size()),
                  fmt::format("frame {} of {}: loss {:.5f} -> {:.5f}", done, frames.size(), fitted.loss_before,
                              fitted.loss_after));
  });
  progress.finish();
  print_tuning(device);
  if (!is_whole) fmt::print("interrupted: the other frames have the pose they had; --resume goes on\n");
  fmt::print("{}\nwrote {}: give it to eval, render, export, train or inspect by --poses\n", poses.summary(),
             options.output.string());
}

}  // namespace

void add_fit_poses_command(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("fit-poses",
                         "Fit the registered poses of a capture to its pictures by a trained avatar, which stays as\n"
                         "it is: a sequence that training never saw is then drawn where the person stands rather than\n"
                         "where the tracker believed. Held-out cameras are not looked at. Writes the body parameters\n"
                         "of all frames, as smplx.npz has them");
  auto options = std::make_shared<FitOptions>();
  command->add_option("--run", options->run, "Run folder of `degas train`")->required();
  command->add_option("--data", options->data, "Capture whose poses are fitted")->required();
  command->add_option("--out", options->output, "File to write, e.g. poses.npz")->required();
  command->add_option("--cameras", options->cameras,
                      fmt::format("{} (default: those that training used)", cameras_help));
  command->add_option("--frames", options->frames, fmt::format("{}; the others keep their pose", frames_help));
  command->add_option("--steps", options->steps, "Steps for each frame, each of which draws all cameras")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000));
  command->add_flag("--resume", options->resume, "Go on with the frames that --out lacks");
  add_capture_options(*command, options->capture);
  add_device_options(*command, options->device);
  command->callback([options] { fit(*options); });
}

}  // namespace degas
