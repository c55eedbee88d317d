#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "host/device/device.h"
#include "host/device/tuning_table.h"
#include "model/config.h"
#include "model/data/capture.h"

namespace degas {

/// --device, --kernels, --memory-limit and --tune, as every command that computes has them.
struct DeviceChoice {
  std::string selector;
  std::optional<KernelSet> kernel_set;
  size_t memory_limit_mib = 0;
  std::optional<TuneMode> tune;
  DeviceOptions options() const {
    DeviceOptions options;
    options.selector = selector;
    options.kernel_set = kernel_set;
    options.memory_limit = memory_limit_mib << 20;
    return options;
  }
};
void add_device_options(CLI::App& command, DeviceChoice& choice);
/// What tuning took and gained, where there was any.
void print_tuning(const Device& device);

/// --format, --poses, --codes and --cache, as every command that opens a capture has them.
struct CaptureChoice {
  std::string format;
  std::filesystem::path poses, codes, cache;
  /// As the config wants captures opened.
  CaptureOptions options(const Config& config) const;
};
void add_capture_options(CLI::App& command, CaptureChoice& choice);

inline constexpr const char* format_help = "Layout of the capture (default: told from its files)";
inline constexpr const char* poses_help =
    "Body parameters in place of the capture's own: an .npz with smplx.npz's arrays, as fit-poses writes it\n"
    "(default: the capture's)";
inline constexpr const char* cameras_help = "Cameras, e.g. cam00,cam03 or cam00:cam08:2";
inline constexpr const char* frames_help = "Frames, e.g. 0,4,8:20:2 or 0:400:4 (default: all)";

}  // namespace degas
