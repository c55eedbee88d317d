#include "model/cli/shared_options.h"

#include <charconv>
#include <optional>
#include <sstream>

#include "host/error.h"

namespace degas {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  if (!text.empty() && text.back() == separator) parts.emplace_back();
  return parts;
}

std::optional<int> number(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

void add_device_options(CLI::App& command, DeviceChoice& choice) {
  command.add_option("--device", choice.selector,
                     "Index or part of the name, see `degas devices` (default: the largest GPU, else the CPU)");
  command
      .add_option("--memory-limit", choice.memory_limit_mib,
                  "MiB of device memory that may be taken; more than that ends the command with an\n"
                  "error (default: as much as the device has)")
      ->check(CLI::Range(size_t{1}, size_t{1} << 30));
}

CaptureOptions capture_options(const Config& config, const std::filesystem::path& cache) {
  CaptureOptions options;
  options.image_scale = config.data.image_scale;
  options.cache = cache;
  return options;
}

std::vector<int> parse_frames(const std::string& text, int limit, const std::string& option) {
  std::vector<int> frames;
  for (const std::string& part : split(text.empty() ? ":" : text, ',')) {
    const auto fail = [&](const char* reason) {
      throw Error::format("{} {}: '{}' {}; give frames of 0 .. {} as in 0,4,8:20:2", option, text, part, reason,
                          limit - 1);
    };
    const std::vector<std::string> fields = split(part, ':');
    if (fields.empty() || fields.size() > 3) fail("is no frame and no range");
    std::optional<int> values[3];
    for (size_t i = 0; i < fields.size(); ++i) {
      values[i] = number(fields[i]);
      if (!values[i] && (!fields[i].empty() || fields.size() == 1)) fail("is no number");
    }
    const int first = values[0].value_or(0);
    const int last = fields.size() == 1 ? first + 1 : values[1].value_or(limit);
    const int stride = values[2].value_or(1);
    if (first < 0 || last > limit || first >= last || stride < 1) fail("lies outside the capture");
    for (int frame = first; frame < last; frame += stride) frames.push_back(frame);
  }
  return frames;
}

std::vector<std::string> split_names(const std::string& text) {
  return split(text, ',');
}

}  // namespace degas
