#include <memory>

#include "host/error.h"
#include "model/cli/commands.h"
#include "model/cli/progress.h"
#include "model/data/synthetic_capture.h"

namespace degas {

void add_synth_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "synth",
      "Make a synthetic capture: a talking, moving mannequin seen by a ring of cameras.\n"
      "Writes DIR/P1C1 (training sequence) and DIR/P1C2 (novel sequence) in the DREAMS layout, and DIR/body.npz");
  struct Options {
    std::filesystem::path output;
    SyntheticOptions synthetic;
  };
  auto options = std::make_shared<Options>();
  SyntheticOptions& synthetic = options->synthetic;
  command->add_option("--out", options->output, "Folder to write")->required();
  command->add_option("--frames", synthetic.frames, "Frames of the training sequence")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  command->add_option("--novel-frames", synthetic.novel_frames, "Frames of the novel sequence")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  command->add_option("--views", synthetic.views, "Cameras of the ring")
      ->capture_default_str()
      ->check(CLI::Range(3, 99));
  command->add_option("--width", synthetic.width, "Pixels; even")->capture_default_str()->check(CLI::Range(32, 8192));
  command->add_option("--height", synthetic.height, "Pixels; even")->capture_default_str()->check(CLI::Range(32, 8192));
  command->add_option("--seed", synthetic.seed, "Same seed, same capture")->capture_default_str();
  command->callback([options] {
    Progress progress;
    write_synthetic_capture(options->output, options->synthetic, [&](int done, int total) {
      progress.show(static_cast<double>(done) / total, fmt::format("picture {} of {}", done, total));
    });
    progress.finish();
    fmt::print("wrote {0}/P1C1, {0}/P1C2 and {0}/body.npz\n", options->output.string());
  });
}

}  // namespace degas
