#include <memory>

#include "host/error.h"
#include "model/cli/commands.h"
#include "model/cli/driven_run.h"
#include "model/train/exporter.h"

namespace degas {
namespace {

struct ExportOptions {
  std::filesystem::path run, data, output;
  int frame = 0;
  CaptureChoice capture;
  DeviceChoice device;
};

}  // namespace

void add_export_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "export",
      "Write one posed frame as a .ply that 3DGS viewers read, and beside it the Gaussian maps in UV space as a\n"
      "multi-channel OpenEXR (same name, .exr)");
  auto options = std::make_shared<ExportOptions>();
  command->add_option("--run", options->run, "Run folder of `degas train`")->required();
  command->add_option("--data", options->data, "Capture that supplies the driving signals")->required();
  command->add_option("--frame", options->frame, "Frame of the capture")->required();
  command->add_option("--out", options->output, "File to write, e.g. avatar.ply")->required();
  add_capture_options(*command, options->capture);
  add_device_options(*command, options->device);
  command->callback([options] {
    DrivenRun run(options->run, options->data, options->capture, options->device);
    const int frames = run.capture->frame_count();
    if (options->frame < 0 || options->frame >= frames)
      throw Error::format("--frame {}: the capture has frames 0 .. {}", options->frame, frames - 1);
    export_frame(run.device, run.avatar, *run.capture, options->frame, options->output);
    std::filesystem::path maps = options->output;
    maps.replace_extension(".exr");
    fmt::print("wrote {} and {}\n", options->output.string(), maps.string());
  });
}

}  // namespace degas
