#include "model/train/trainer.h"

#include <limits>
#include <mutex>
#include <numeric>
#include <set>
#include <sstream>

#include "host/io/checkpoint.h"
#include "tests/support/catch.h"
#include "tests/support/test_devices.h"
#include "tests/support/training_scene.h"
#include "tests/support/training_steps.h"

using namespace degas;
using namespace degas::test;

namespace {

/// checkpoint.bin of an uninterrupted run.
std::string trained_bytes(const Config& config, Device& device = wide()) {
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  const auto capture = open_scene();
  Trainer trainer(device, config, *capture, run);
  CHECK(train(trainer, config) == TrainingEnd::Finished);
  return file_text(run.checkpoint_file());
}

}  // namespace

TEST_CASE("one seed, one checkpoint; another seed, another") {
  Config config = tiny_config();
  const std::string bytes = trained_bytes(config);
  // Bytes are compared outside of CHECK, which would print them.
  const bool repeats = bytes == trained_bytes(config);
  CHECK(repeats);
  CHECK(bytes.size() > 1000000);
  config.train.seed = 2;
  const std::string other = trained_bytes(config);
  // The header tells the seed; what was trained with it lies at the end.
  const auto arrays = [](const std::string& checkpoint) {
    return checkpoint.substr(checkpoint.size() - 1000000, 999000);
  };
  const bool seed_matters = arrays(bytes) != arrays(other);
  CHECK(seed_matters);
}

TEST_CASE("stopped and resumed training gives the bits of the uninterrupted one") {
  Config config = tiny_config();
  config.train.refine_poses = true;
  SECTION("registered poses") {
    config.train.refine_poses = false;
  }
  KernelSet set = KernelSet::Wide;
  SECTION("refined poses") {
    set = GENERATE(from_range(kernel_sets()));
  }
  SECTION("static maps") {
    config.net.kind = NetKind::Static;
  }
  SECTION("skips") {
    config.net.kind = NetKind::Skips;
  }
  SECTION("a network per texel") {
    config.net.kind = NetKind::Mlp;
  }
  config.train.schedule = LearningRateSchedule::Cosine;
  config.data.crop_to_person = true;
  config.net.noise_std = 1;
  Device& device = test::device(set);
  const std::string uninterrupted = trained_bytes(config, device);

  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  for (int64_t stop_at : {1, 7, 13}) {
    const auto capture = open_scene();
    Trainer trainer(device, config, *capture, run);
    if (run.has_checkpoint()) trainer.resume();
    CHECK(train(trainer, config, stop_at) == TrainingEnd::Interrupted);
    CHECK(trainer.step() == stop_at);
  }
  // What ran on after the checkpoint and was killed leaves lines in the history: they go, those before stay.
  run.append_history({{"step", 14}, {"loss", -1}});
  const auto capture = open_scene();
  Trainer trainer(device, config, *capture, run);
  trainer.resume();
  CHECK(trainer.step() == 13);
  CHECK(train(trainer, config) == TrainingEnd::Finished);
  const bool same = file_text(run.checkpoint_file()) == uninterrupted;
  CHECK(same);
  const std::vector<nlohmann::json> history = history_of(run);
  REQUIRE(history.size() == 20);
  for (size_t i = 0; i < history.size(); ++i) {
    CHECK(history[i].at("step") == i + 1);
    CHECK(history[i].at("loss").get<double>() > 0);
  }
}

TEST_CASE("nothing is allocated on the device after the first step") {
  Config config = tiny_config();
  config.train.refine_poses = true;
  config.data.crop_to_person = GENERATE(false, true);
  config.train.validation_every = 5;
  config.data.validation = {"cam02"};
  config.train.iterations = 40;
  // Three views of the four cameras left: where a frame's deck ends within a step, that step has but two.
  config.train.views_per_step = 3;
  config.net.color_degree = 1;
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  const auto capture = open_scene();
  DeviceOptions options;
  options.kernel_set = GENERATE(KernelSet::Wide, KernelSet::Gpu);
  Device fresh(options);  // whose pool no other test has filled
  Trainer trainer(fresh, config, *capture, run);
  std::vector<size_t> allocations;
  std::vector<double> losses, validation;
  trainer.run(budget_of(config.train.iterations), [&](const TrainingReport& report) {
    allocations.push_back(fresh.memory_statistics().device_allocations);
    losses.push_back(report.losses.at("loss"));
    if (report.validation_psnr) validation.push_back(*report.validation_psnr);
    CHECK(report.step == static_cast<int64_t>(losses.size()));
    CHECK(report.skipped == 0);
  });
  REQUIRE(allocations.size() == 40);
  CAPTURE(allocations);
  CHECK(allocations.front() == allocations.back());

  CAPTURE(losses, validation);
  const auto mean = [](auto begin, auto end) { return std::accumulate(begin, end, 0.0) / (end - begin); };
  CHECK(mean(losses.end() - 6, losses.end()) < 0.8 * mean(losses.begin(), losses.begin() + 6));
  REQUIRE(validation.size() == 8);
  CHECK(validation.back() > validation.front() + 1);
}

TEST_CASE("a held-out camera is never looked at: neither its pictures nor its face codes") {
  Config config = tiny_config();
  config.train.iterations = 12;
  config.train.validation_every = 4;
  config.data.hold_out = {"cam02"};
  config.data.validation = {"cam01"};
  config.data.crop_to_person = true;
  std::mutex mutex;  // the loader's thread looks too
  std::set<int> seen, spoken_to;
  ChangedCapture capture;
  capture.change_sample = [&](const Sample& sample) {
    const std::lock_guard lock(mutex);
    seen.insert(sample.camera);
  };
  const auto source = open_scene();
  capture.replace_code = [&](int frame, int camera) {
    const std::lock_guard lock(mutex);
    spoken_to.insert(camera);
    return source->face_code(frame, camera);
  };
  const TemporaryFolder folder;
  train_run(folder / "run", config, capture);
  CHECK(seen == std::set<int>{0, 1, 3, 4});
  CHECK(spoken_to == std::set<int>{0, 1, 3, 4});
}

TEST_CASE("a resumed run may be longer than it was planned, and reports as it is told now") {
  Config config = tiny_config();
  config.train.iterations = 4;
  const TemporaryFolder folder;
  const auto capture = open_scene();
  const RunFolder run = train_run(folder / "run", config, *capture);
  config.train.iterations = 9;
  config.train.log_every = 3;
  Trainer trainer(wide(), config, *capture, run);
  trainer.resume();
  CHECK(train(trainer, config) == TrainingEnd::Finished);
  CHECK(trainer.step() == 9);
  CHECK(history_of(run).size() == 4 + 2);
  CHECK(load_config(run.config_file()).train.iterations == 9);
}

TEST_CASE("a frame's pose first moves by the poses' learning rate") {
  Config config = tiny_config();
  config.train.refine_poses = true;
  config.train.pose_learning_rate = 0.01;
  const auto capture = open_scene();
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  Trainer trainer(wide(), config, *capture, run);
  train(trainer, config, 1);
  const Checkpoint checkpoint = read_checkpoint(run.checkpoint_file());
  std::set<float> steps;
  for (const auto& [name, values] : checkpoint.arrays) {
    if (!name.starts_with("pose.0") || name.ends_with("_moment")) continue;  // a frame's; the network has pose. too
    for (const float value : values) steps.insert(std::abs(value));
  }
  CHECK(steps == std::set<float>{0, 0.01F});  // 0: of other frames, and of what no picture shows
}
