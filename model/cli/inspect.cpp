#include <memory>
#include <thread>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "model/cli/commands.h"
#include "model/cli/shared_options.h"
#include "model/data/selection.h"
#include "model/inspect/page.h"

namespace degas {
namespace {

struct InspectOptions {
  std::filesystem::path data, body, output, poses;
  std::string format, cameras, frames;
};

void inspect(const InspectOptions& options) {
  std::vector<std::string> warnings;
  CaptureOptions capture_options;
  capture_options.format = options.format;
  capture_options.poses = options.poses;
  capture_options.incomplete = true;
  capture_options.warn = [&](const std::string& text) { warnings.push_back(text); };
  const std::unique_ptr<Capture> capture = open_uncached_capture(options.data, capture_options);
  std::optional<BodyModel> body;
  if (!options.body.empty()) body = BodyModel::load(options.body);
  InspectionOptions choice;
  choice.cameras = selection_parts(options.cameras);
  choice.frames = selection_parts(options.frames);
  choice.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const Inspection found = inspect_capture(*capture, body ? &*body : nullptr, choice, std::move(warnings));
  write_text(options.output / "inspect.json", inspection_json(found).dump(1) + "\n");
  write_text(options.output / "index.html", inspection_page(found, "degas inspect: " + options.data.string()));
  fmt::print("{}wrote {} and inspect.json\n", inspection_text(found), (options.output / "index.html").string());
}

}  // namespace

void add_inspect_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "inspect",
      "Look a capture through before training: prints what is there and what lacks, and writes OUT/index.html (body "
      "over\n"
      "photographs, overlap with the masks, plan of the cameras, UV atlas, faces) and OUT/inspect.json. Tries known\n"
      "mistakes (flipped axes, camera to world, millimetres, frames off by one, mirrored pictures, flat hands) and "
      "says\n"
      "which would fit better. Works without body, fit or masks too, and says what cannot be told then");
  auto options = std::make_shared<InspectOptions>();
  command->add_option("--data", options->data, "Capture folder")->required();
  command->add_option("--body", options->body, "Body model, SMPL-X npz layout");
  command->add_option("--out", options->output, "Folder to write")->required();
  command->add_option("--format", options->format, format_help)->check(CLI::IsMember(capture_formats()));
  command->add_option("--poses", options->poses, poses_help);
  command->add_option("--cameras", options->cameras, fmt::format("{} (default: up to 40)", cameras_help));
  command->add_option("--frames", options->frames,
                      "Frames, e.g. 0,4,8:20:2 or 0:400:4 (default: up to 12, spread evenly)");
  command->callback([options] { inspect(*options); });
}

}  // namespace degas
