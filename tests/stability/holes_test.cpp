#include <cmath>

#include "tests/support/training_scene.h"
#include "tests/support/training_steps.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("a capture with missing frames, cameras and face codes is trained on as far as it goes") {
  Config config = tiny_config();
  config.train.iterations = 15;
  config.train.validation_every = 5;
  config.data.validation = {"cam04"};
  ChangedCapture capture;
  // Frame 1 has no picture, camera 3 none but one, camera 4 (validation) lacks some, and all but frame 0 lack codes.
  capture.lacks_image = [](int frame, int camera) {
    return frame == 1 || (camera == 3 && frame != 5) || (camera == 4 && frame < 3);
  };
  const auto source = open_scene();
  capture.replace_code = [&](int frame, int camera) {
    return frame == 0 && camera != 0 ? source->face_code(frame, camera) : std::nullopt;
  };
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  Trainer trainer(wide(), config, capture, run);
  int validations = 0;
  trainer.run(budget_of(config.train.iterations), [&](const TrainingReport& report) {
    CHECK(std::isfinite(report.losses.at("loss")));
    CHECK(report.skipped == 0);
    if (report.validation_psnr) CHECK(std::isfinite(*report.validation_psnr));
    validations += report.validation_psnr.has_value();
  });
  CHECK(trainer.step() == 15);
  CHECK(validations == 3);
}
