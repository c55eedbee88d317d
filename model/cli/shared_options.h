#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "host/device/device.h"
#include "model/config.h"
#include "model/data/capture.h"

namespace degas {

/// --device and --memory-limit, as every command that computes has them.
struct DeviceChoice {
  std::string selector;
  size_t memory_limit_mib = 0;
  DeviceOptions options() const {
    DeviceOptions options;
    options.selector = selector;
    options.memory_limit = memory_limit_mib << 20;
    return options;
  }
};
void add_device_options(CLI::App& command, DeviceChoice& choice);

/// How a config wants its capture opened; an empty cache folder means the user's.
CaptureOptions capture_options(const Config& config, const std::filesystem::path& cache);

/// "0,4,8:20:2" as numbers; FIRST:LAST:STRIDE leaves LAST out, and any of the three may be empty. `limit` is the number
/// of frames. Empty text: all of them. Throws Error naming the option and the part that is wrong.
std::vector<int> parse_frames(const std::string& text, int limit, const std::string& option);

/// "cam00,cam03" as names.
std::vector<std::string> split_names(const std::string& text);

}  // namespace degas
