#include <algorithm>
#include <cmath>

#include "tests/support/training_scene.h"
#include "tests/support/training_steps.h"

using namespace degas;
using namespace degas::test;

namespace {

/// The Gaussians' scales over their base scales in the first frame, sorted.
std::vector<double> scale_ratios(Device& device, const Trainer& trainer, const Capture& capture) {
  const Avatar& avatar = trainer.avatar();
  std::optional<std::vector<float>> code;
  for (int camera = 0; !code; ++camera) code = capture.face_code(0, camera);
  Tape tape(device, false);
  const Tensor logs = avatar.decode(tape, avatar.upload(avatar.signal(capture, 0, *code))).gaussians.log_scales;
  const std::vector<double> now = logs.to_host<double>(), base = avatar.base().log_scales.to_host<double>();
  std::vector<double> ratios;
  for (size_t i = 0; i < now.size(); ++i) ratios.push_back(std::exp(now[i] - base[i]));
  std::sort(ratios.begin(), ratios.end());
  return ratios;
}

}  // namespace

TEST_CASE("an avatar whose scales start at 50 times their base returns") {
  const auto set = GENERATE(from_range(kernel_sets()));
  Config config = tiny_config();
  config.train.learning_rate = 2e-3;
  config.train.iterations = 150;
  const auto capture = open_scene();
  const auto train_exploded = [&](std::vector<double>* ratios) {
    const TemporaryFolder folder;
    Trainer trainer(device(set), config, *capture, make_run(folder / "run", config));
    for (int axis = 0; axis < 3; ++axis) HeadBias(trainer, "head.rotation_scale", 4 + axis).add(std::log(50));
    const std::vector<double> before = scale_ratios(device(set), trainer, *capture);
    CHECK(before.front() > 40);
    CHECK(before.back() < 60);
    std::vector<TrainingReport> reports;
    trainer.run(budget_of(config.train.iterations), [&](const TrainingReport& report) { reports.push_back(report); });
    *ratios = scale_ratios(device(set), trainer, *capture);
    CHECK(reports.front().losses.at("scale") > 0.1);
    CHECK(reports.front().exploded_texels == static_cast<int64_t>(before.size() / 3));
    CHECK(reports.back().skipped == 0);
    return reports;
  };
  std::vector<double> ratios;
  const auto returned = train_exploded(&ratios);
  CHECK(returned.back().losses.at("scale") == 0);
  CHECK(returned.back().dead_texels == 0);
  CHECK(returned.back().exploded_texels == 0);
  CHECK(ratios.back() <= 10);
  CHECK(ratios.front() > 1e-3);
  CHECK(mean_of_last_losses(returned) < 0.02);

  // What the floor is for: L_s alone pushes scales out of sight, from where no picture brings them back.
  config.loss.collapse_weight = 0;
  config.train.iterations = 40;
  const auto vanished = train_exploded(&ratios);
  CHECK(ratios[ratios.size() / 2] < 1e-6);
  CHECK(mean_of_last_losses(vanished) > 0.05);
}
