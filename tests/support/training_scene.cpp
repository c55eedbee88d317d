#include "tests/support/training_scene.h"

#include <fstream>

#include "model/data/synthetic_capture.h"
#include "model/train/trainer.h"
#include "tests/support/test_devices.h"

namespace degas::test {

namespace fs = std::filesystem;

const fs::path& training_scene() {
  static const TemporaryFolder folder;
  static const bool written = [] {
    SyntheticOptions options;
    options.frames = 6;
    options.novel_frames = 2;
    options.views = 5;
    options.width = 64;
    options.height = 80;
    write_synthetic_capture(folder.path(), options);
    return true;
  }();
  static_cast<void>(written);
  return folder.path();
}

std::unique_ptr<Capture> open_scene(const std::string& sequence) {
  CaptureOptions options;
  options.cache = training_scene() / "cache";
  return open_capture(training_scene() / sequence, options);
}

Config tiny_config() {
  Config config;
  config.net.resolution = 128;
  config.net.width = 0.25;
  config.loss.lpips_weight = 0;
  config.train.iterations = 20;
  config.train.views_per_step = 2;
  config.train.learning_rate = 1e-3;
  config.train.gradient_clip.offset_limit = 0;  // its steps of the offset term alone do not lower the image loss
  config.train.log_every = 1;
  config.train.validation_every = 0;
  config.train.checkpoint_every = 0;
  return config;
}

RunFolder make_run(const fs::path& folder, const Config& config) {
  RunFolder run(folder);
  run.create(config, training_scene() / "body.npz");
  return run;
}

RunFolder train_run(const fs::path& folder, const Config& config, const Capture& capture) {
  const RunFolder run = make_run(folder, config);
  Trainer trainer(device(KernelSet::Wide), config, capture, run);
  TrainingBudget budget;
  budget.iterations = config.train.iterations;
  trainer.run(budget, [](const TrainingReport&) {});
  return run;
}

}  // namespace degas::test
