#include <memory>

#include "host/error.h"
#include "host/io/video.h"
#include "model/cli/commands.h"
#include "model/cli/driven_run.h"
#include "model/cli/progress.h"
#include "model/data/selection.h"
#include "model/train/picture.h"
#include "model/train/stop_signal.h"
#include "model/train/turntable.h"

namespace degas {
namespace {

struct RenderOptions {
  std::filesystem::path run, data, output;
  std::string cameras, frames;
  bool turntable = false;
  double frames_per_second = 25;
  CaptureChoice capture;
  DeviceChoice device;
};

/// A picture to draw.
struct Shot {
  int frame;
  Camera view;
  std::filesystem::path file;  ///< below the output folder
};

std::vector<Shot> plan_shots(const RenderOptions& options, const Avatar& avatar, const Capture& capture,
                             bool is_video) {
  const std::vector<int> frames = selected_frames(selection_parts(options.frames), capture.frame_count(), "--frames");
  const auto file_of = [](int frame) { return fmt::format("{:06}.png", frame); };
  std::vector<Shot> shots;
  if (options.turntable) {
    const std::vector<Camera> circle = turntable(avatar, capture, frames);
    for (size_t i = 0; i < frames.size(); ++i) shots.push_back({frames[i], circle[i], file_of(frames[i])});
    return shots;
  }
  const std::vector<std::string>& names = capture.camera_names();
  const std::vector<std::string> parts =
      options.cameras.empty() ? std::vector<std::string>{names.front()} : selection_parts(options.cameras);
  const std::vector<int> cameras = selected_cameras(parts, names, "--cameras");
  if (is_video && cameras.size() > 1) {
    throw Error::format("--cameras {}: a video shows one camera; name a folder in --out for several", options.cameras);
  }
  for (const int camera : cameras) {
    const std::filesystem::path folder = cameras.size() > 1 ? names[static_cast<size_t>(camera)] : std::string();
    for (const int frame : frames) shots.push_back({frame, capture.camera(camera), folder / file_of(frame)});
  }
  return shots;
}

void render(const RenderOptions& options) {
  DrivenRun run(options.run, options.data, options.capture, options.device);
  Device& device = run.device;
  TrainedAvatar& avatar = run.avatar;
  const Capture& capture = *run.capture;
  FaceCodes codes = avatar.face_codes(capture);
  const bool is_video = options.output.extension() == ".mp4";
  const std::vector<Shot> shots = plan_shots(options, avatar.avatar(), capture, is_video);

  std::unique_ptr<VideoWriter> video;
  if (options.output.has_parent_path()) std::filesystem::create_directories(options.output.parent_path());
  if (is_video) {
    video = std::make_unique<VideoWriter>(options.output, shots[0].view.width, shots[0].view.height,
                                          options.frames_per_second, VideoQuality::Viewing);
  } else {
    for (const Shot& shot : shots) std::filesystem::create_directories((options.output / shot.file).parent_path());
  }
  const StopSignal stop;
  Progress progress;
  SplatWorkspace workspace;
  size_t done = 0;
  while (done < shots.size() && !StopSignal::requested()) {
    const Shot& shot = shots[done];
    Tape tape(device, false);
    const Splats splats = avatar.drive(tape, capture, codes, shot.frame);
    const SplatImage image =
        splat(tape, workspace, splats, shot.view, {1, 1, 1}, splat_options(avatar.config().render));
    const Image8 picture = to_image8(image.color);
    if (video) {
      video->write(picture);
    } else {
      write_image(options.output / shot.file, picture);
    }
    ++done;
    progress.show(static_cast<double>(done) / static_cast<double>(shots.size()),
                  fmt::format("picture {} of {}", done, shots.size()));
  }
  if (video) video->finish();
  progress.finish();
  print_tuning(device);
  fmt::print("wrote {} pictures to {}\n", done, options.output.string());
}

}  // namespace

void add_render_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "render",
      "Draw a trained avatar, driven by a capture's poses and face codes (its pictures are not needed), as a video or\n"
      "PNG files over white");
  auto options = std::make_shared<RenderOptions>();
  command->add_option("--run", options->run, "Run folder of `degas train`")->required();
  command->add_option("--data", options->data, "Capture that supplies the driving signals")->required();
  CLI::Option* cameras =
      command->add_option("--cameras,--camera", options->cameras,
                          fmt::format("{} (default: the first); several write a folder each", cameras_help));
  command->add_flag("--turntable", options->turntable, "Circle the person once over the frames instead")
      ->excludes(cameras);
  command->add_option("--frames", options->frames, frames_help);
  command->add_option("--fps", options->frames_per_second, "Frames per second of the video")->capture_default_str();
  command->add_option("--out", options->output, "VIDEO.mp4, or a folder for PNG files")->required();
  add_capture_options(*command, options->capture);
  add_device_options(*command, options->device);
  command->callback([options] { render(*options); });
}

}  // namespace degas
