#include "model/cli/shared_options.h"

#include <fmt/format.h>

#include <map>

#include "host/device/tuner.h"

namespace degas {
void add_device_options(CLI::App& command, DeviceChoice& choice) {
  command.add_option("--device", choice.selector,
                     "Index or part of the name, see `degas devices` (default: the largest GPU, else the CPU)");
  const std::map<std::string, KernelSet> sets = {{"wide", KernelSet::Wide}, {"gpu", KernelSet::Gpu}};
  command
      .add_option("--kernels", choice.kernel_set,
                  "wide or gpu: vectors in long loops, or cooperative work-groups; each runs on every device that\n"
                  "has room for it; another choice, other bits (default: gpu on GPUs with room for its\n"
                  "work-groups, else wide)")
      ->transform(CLI::CheckedTransformer(sets))
      ->option_text("wide|gpu");
  command
      .add_option("--memory-limit", choice.memory_limit_mib,
                  "MiB of device memory that may be taken; more than that ends the command with an\n"
                  "error (default: as much as the device has)")
      ->check(CLI::Range(size_t{1}, size_t{1} << 30));
  const std::map<std::string, TuneMode> modes = {
      {"off", TuneMode::Off}, {"fast", TuneMode::Fast}, {"full", TuneMode::Full}};
  command
      .add_option("--tune", choice.tune,
                  "off, fast or full: whether to time other kernel parameters than the built-in ones when a\n"
                  "launch is met first, a few or all; the best go to the user's cache, tuning.json (default: off)")
      ->transform(CLI::CheckedTransformer(modes))
      ->option_text("off|fast|full");
}

void print_tuning(const Device& device) {
  const std::string summary = device.tuner() ? device.tuner()->summary() : "";
  if (!summary.empty()) fmt::print("tuning: {}\n", summary);
}

void add_capture_options(CLI::App& command, CaptureChoice& choice) {
  command.add_option("--format", choice.format, format_help)->check(CLI::IsMember(capture_formats()));
  command.add_option("--poses", choice.poses, poses_help);
  command.add_option(
      "--codes", choice.codes,
      "Where the capture's face codes lie: a folder with dpe/ as encode-faces writes it, a zip of them, or\n"
      "a table (.npz, .npy) (default: in the capture)");
  command.add_option("--cache", choice.cache, "Folder of decoded pictures (default: the user's cache folder)");
}

CaptureOptions CaptureChoice::options(const Config& config) const {
  CaptureOptions options;
  options.image_scale = config.data.image_scale;
  options.cache = cache;
  options.format = format;
  options.poses = poses;
  options.codes = codes;
  return options;
}

}  // namespace degas
