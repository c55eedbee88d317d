#include <memory>

#include "host/error.h"
#include "host/io/video.h"
#include "model/cli/commands.h"
#include "model/cli/progress.h"
#include "model/cli/shared_options.h"
#include "model/train/picture.h"
#include "model/train/stop_signal.h"
#include "model/train/trained_avatar.h"
#include "model/train/training_views.h"
#include "model/train/turntable.h"

namespace degas {
namespace {

struct RenderOptions {
  std::filesystem::path run, data, output, cache;
  std::string camera, frames;
  bool turntable = false;
  double frames_per_second = 25;
  DeviceChoice device;
};

void render(const RenderOptions& options) {
  Device device(options.device.options());
  TrainedAvatar avatar(device, RunFolder(options.run));
  const std::unique_ptr<Capture> capture = open_capture(options.data, capture_options(avatar.config(), options.cache));
  FaceCodes codes = avatar.face_codes(*capture);
  const std::vector<int> frames = parse_frames(options.frames, capture->frame_count(), "--frames");
  std::vector<Camera> cameras;
  if (options.turntable) {
    cameras = turntable(avatar.avatar(), *capture, frames);
  } else {
    const int camera = options.camera.empty() ? 0 : camera_indices(*capture, {options.camera}, "--camera")[0];
    cameras.assign(frames.size(), capture->camera(camera));
  }

  const bool to_video = options.output.extension() == ".mp4";
  std::unique_ptr<VideoWriter> video;
  if (options.output.has_parent_path()) std::filesystem::create_directories(options.output.parent_path());
  if (to_video) {
    video = std::make_unique<VideoWriter>(options.output, cameras[0].width, cameras[0].height,
                                          options.frames_per_second, VideoQuality::Viewing);
  } else {
    std::filesystem::create_directories(options.output);
  }
  const StopSignal stop;
  Progress progress;
  SplatWorkspace workspace;
  size_t done = 0;
  while (done < frames.size() && !StopSignal::requested()) {
    Tape tape(device, false);
    const Splats splats = avatar.drive(tape, *capture, codes, frames[done]);
    const SplatImage image =
        splat(tape, workspace, splats, cameras[done], {1, 1, 1}, splat_options(avatar.config().render));
    const Image8 picture = to_image8(image.color);
    if (to_video) {
      video->write(picture);
    } else {
      write_image(options.output / fmt::format("{:06}.png", frames[done]), picture);
    }
    ++done;
    progress.show(static_cast<double>(done) / static_cast<double>(frames.size()),
                  fmt::format("frame {} of {}", done, frames.size()));
  }
  if (video) video->finish();
  progress.finish();
  fmt::print("wrote {} frames to {}\n", done, options.output.string());
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
  CLI::Option* camera = command->add_option("--camera", options->camera, "Camera of the capture (default: its first)");
  command->add_flag("--turntable", options->turntable, "Circle the person once over the frames instead")
      ->excludes(camera);
  command->add_option("--frames", options->frames, "Frames, e.g. 0,4,8:20:2 (default: all)");
  command->add_option("--fps", options->frames_per_second, "Frames per second of the video")->capture_default_str();
  command->add_option("--out", options->output, "VIDEO.mp4, or a folder for PNG files")->required();
  command->add_option("--cache", options->cache, "Folder of decoded pictures (default: the user's cache folder)");
  add_device_options(*command, options->device);
  command->callback([options] { render(*options); });
}

}  // namespace degas
