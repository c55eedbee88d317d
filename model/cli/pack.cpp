#include <chrono>
#include <memory>
#include <thread>

#include "host/error.h"
#include "model/cli/commands.h"
#include "model/cli/progress.h"
#include "model/cli/shared_options.h"
#include "model/data/packed_capture.h"
#include "model/data/selected_capture.h"
#include "model/data/selection.h"
#include "model/train/stop_signal.h"

namespace degas {
namespace {

struct PackCommand {
  std::filesystem::path data, output, poses, codes;
  std::string format, frames, cameras;
  double image_scale = 1;
};

void pack(const PackCommand& command) {
  if (std::filesystem::is_directory(command.output)) {
    throw Error::format("{}: is a folder; --out names the file to write", command.output.string());
  }
  CaptureOptions opening;
  opening.image_scale = command.image_scale;
  opening.format = command.format;
  opening.poses = command.poses;
  opening.codes = command.codes;
  std::unique_ptr<Capture> whole = open_uncached_capture(command.data, opening);
  const std::vector<int> frames = selected_frames(selection_parts(command.frames), whole->frame_count(), "--frames");
  const std::vector<int> cameras =
      selected_cameras(selection_parts(command.cameras), whole->camera_names(), "--cameras");
  const std::unique_ptr<Capture> capture = selected(std::move(whole), frames, cameras);
  const StopSignal stop;
  Progress progress;
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  PackOptions options;
  options.image_scale = command.image_scale;
  options.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  options.stop_requested = StopSignal::requested;
  options.progress = [&](int64_t frames, int64_t pictures) {
    progress.show(static_cast<double>(frames) / capture->frame_count(),
                  fmt::format("frame {} of {}  {:.0f} pictures/s", frames, capture->frame_count(),
                              static_cast<double>(pictures) / seconds()));
  };
  const PackSummary summary = write_pack(command.output, *capture, options);
  progress.finish();
  if (summary.interrupted) {
    fmt::print("interrupted: nothing is written\n");
    return;
  }
  fmt::print("wrote {}: {} frames, {} cameras, {} pictures, {} face codes, {:.1f} MiB; train with --data {}\n",
             command.output.string(), capture->frame_count(), capture->camera_names().size(), summary.pictures,
             summary.codes, static_cast<double>(summary.bytes) / (1 << 20), command.output.string());
}

}  // namespace

void add_pack_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "pack",
      "Put a capture into one file: pictures decoded, masked and at the scale that is trained at, body parameters,\n"
      "cameras and face codes, all with checksums. `degas train --data FILE` then gives the bits of training from the\n"
      "capture, and decodes nothing");
  auto options = std::make_shared<PackCommand>();
  command->add_option("--data", options->data, "Capture folder")->required();
  command->add_option("--out", options->output, "File to write")->required();
  command->add_option("--image-scale", options->image_scale, "As data.image_scale of the config to train with")
      ->capture_default_str();
  command->add_option("--cameras", options->cameras, fmt::format("{} (default: all)", cameras_help));
  command->add_option("--frames", options->frames, fmt::format("{}; they are counted from 0 in the pack", frames_help));
  command->add_option("--format", options->format, format_help)->check(CLI::IsMember(capture_formats()));
  command->add_option("--poses", options->poses, poses_help);
  command->add_option("--codes", options->codes, "Where the capture's face codes lie (default: in the capture)");
  command->callback([options] { pack(*options); });
}

}  // namespace degas
