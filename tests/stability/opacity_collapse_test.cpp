#include <algorithm>

#include "tests/support/training_scene.h"
#include "tests/support/training_steps.h"

using namespace degas;
using namespace degas::test;

namespace {

/// What a training of which the opacity head was changed before its first step reports.
std::vector<TrainingReport> train_changed(KernelSet set, const Config& config, const Capture& capture, size_t stride,
                                          std::vector<float>* risen) {
  const TemporaryFolder folder;
  Trainer trainer(device(set), config, capture, make_run(folder / "run", config));
  HeadBias logits(trainer, "head.color_opacity", 3, stride);
  logits.add(-8);
  std::vector<TrainingReport> reports;
  trainer.run(budget_of(config.train.iterations), [&](const TrainingReport& report) { reports.push_back(report); });
  if (risen) *risen = logits.values();
  return reports;
}

}  // namespace

TEST_CASE("an avatar whose opacities all start at a logit of -8 recovers, and its dead texels are counted") {
  const auto set = GENERATE(from_range(kernel_sets()));
  Config config = tiny_config();
  config.train.learning_rate = 2e-3;
  config.train.iterations = 100;
  const auto capture = open_scene();
  const auto reports = train_changed(set, config, *capture, 1, nullptr);
  const int64_t all = reports.front().dead_texels;
  CHECK(all > 10000);
  CHECK(reports.back().dead_texels < all / 1000);
  CHECK(mean_of_last_losses(reports) < 0.03);

  // What the prior is for: without it nothing is ever seen again.
  config.loss.collapse_weight = 0;
  config.train.iterations = 24;
  const auto lost = train_changed(set, config, *capture, 1, nullptr);
  CHECK(lost.back().dead_texels == all);
  CHECK(mean_of_last_losses(lost) > 0.05);
}

TEST_CASE("dead texels among living ones rise by a learning rate a step") {
  const auto set = GENERATE(from_range(kernel_sets()));
  Config config = tiny_config();
  config.train.iterations = 30;
  const auto capture = open_scene();
  std::vector<float> logits;
  const auto reports = train_changed(set, config, *capture, 7, &logits);
  CHECK(reports.front().dead_texels > 2000);
  CHECK(reports.back().dead_texels == reports.front().dead_texels);  // they need 3000 steps
  const auto risen = std::count_if(logits.begin(), logits.end(), [](float v) { return v == Approx(-8 + 30e-3f); });
  CHECK(risen >= reports.front().dead_texels - 10);
  // Texels without a Gaussian have no gradient, and without the prior these have none either.
  CHECK(std::count(logits.begin(), logits.end(), -8.0f) == static_cast<long>(logits.size()) - risen);
  config.loss.collapse_weight = 0;
  train_changed(set, config, *capture, 7, &logits);
  CHECK(std::count(logits.begin(), logits.end(), -8.0f) == static_cast<long>(logits.size()));
}
