#include <algorithm>
#include <set>

#include "model/gaussians/base_maps.h"
#include "tests/support/training_scene.h"
#include "tests/support/training_steps.h"

using namespace degas;
using namespace degas::test;

namespace {

/// What a training whose avatar begins a centimetre beside its body says of its drift at the end, in units of the
/// position head: poses that are refined may take the centimetre back, and so may the offsets.
double drift_at_the_end(KernelSet set, double weight) {
  Config config = tiny_config();
  config.train.refine_poses = true;
  config.train.learning_rate = 2e-3;
  config.train.iterations = 40;
  config.loss.drift_weight = weight;
  const auto capture = open_scene();
  const TemporaryFolder folder;
  Trainer trainer(device(set), config, *capture, make_run(folder / "run", config));
  HeadBias(trainer, "head.position", 0).add(0.01 / config.gaussians.offset_scale);
  std::vector<double> drifts;
  trainer.run(budget_of(config.train.iterations),
              [&](const TrainingReport& report) { drifts.push_back(report.losses.at("drift")); });
  CHECK(drifts.front() > 0.15);
  return drifts.back();
}

}  // namespace

TEST_CASE("refined poses do not hold an avatar beside its body") {
  const auto set = GENERATE(from_range(kernel_sets()));
  CHECK(drift_at_the_end(set, 0.02) < 0.1);
}

TEST_CASE("without the term they would: pictures do not tell") {
  CHECK(drift_at_the_end(KernelSet::Wide, 1e-9) > 0.15);  // at 0 it is not told
}

TEST_CASE("the parts that may drift are those of the joint with the largest weight") {
  const BodyModel body = BodyModel::load(training_scene() / "body.npz");
  const Config config = tiny_config();
  const auto capture = open_scene();
  const Avatar avatar(wide(), config, body, capture->betas(), capture->face_code_size());
  const BaseMaps maps = make_base_maps(body, capture->betas(), avatar.atlas(), config.gaussians.max_influences,
                                       config.gaussians.thin_axis);
  const std::vector<int32_t> joints = avatar.main_joints();
  REQUIRE(joints.size() == maps.covered.size());
  for (size_t i = 0; i < joints.size(); ++i) {
    const auto first = maps.weights.begin() + static_cast<ptrdiff_t>(i) * maps.influences;
    const auto heaviest = std::max_element(first, first + maps.influences) - maps.weights.begin();
    if (joints[i] != maps.joints[static_cast<size_t>(heaviest)]) FAIL("Gaussian " << i << ": joint " << joints[i]);
  }
  CHECK(std::set<int32_t>(joints.begin(), joints.end()).size() > 10);
}
