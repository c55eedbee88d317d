#ifndef DEGAS_ENGINE_ONLY
#include "bench/support/subject.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>

#include "host/error.h"
#include "model/data/synthetic_capture.h"
#include "model/loss/lpips_weights.h"

namespace degas::bench {

namespace fs = std::filesystem;

Subject::Subject(int width, int height)
    : folder_(fs::temp_directory_path() / fmt::format("degas-bench-{}-{}x{}", getpid(), width, height)) {
  fs::create_directories(folder_);
  const char* data = std::getenv("DEGAS_TEST_DATA");
  const fs::path capture_a = fs::path(data ? data : "") / "data/capture/A/P1C1";
  if (data && width == 480 && height == 640 && fs::exists(capture_a)) {
    name_ = "capture A";
    capture_ = capture_a;
    body_ = fs::path(data) / "data/bodies/male.npz";
    return;
  }
  name_ = "synthetic";
  SyntheticOptions options;
  options.frames = 2;
  options.novel_frames = 1;
  options.views = 4;
  options.width = width;
  options.height = height;
  write_synthetic_capture(folder_, options);
  capture_ = folder_ / "P1C1";
  body_ = folder_ / "body.npz";
}

Subject::~Subject() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

std::unique_ptr<Capture> Subject::capture() const {
  CaptureOptions options;
  options.cache = folder_ / "cache";
  return open_capture(capture_, options);
}

Config benchmark_config(const std::string& name) {
  Config config = load_config(fs::path(DEGAS_CONFIGS) / (name + ".json"));
  try {
    lpips_weights_path(config.loss.lpips_weights, config.loss.lpips_network);
  } catch (const Error& error) {
    fmt::print("{}: without the perceptual loss: {}\n", name, error.what());
    config.loss.lpips_weight = 0;
  }
  return config;
}

}  // namespace degas::bench
#endif
