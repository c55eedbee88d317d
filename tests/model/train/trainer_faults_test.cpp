#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <sstream>

#include "host/error.h"
#include "host/io/checkpoint.h"
#include "model/train/trainer.h"
#include "tests/support/catch.h"
#include "tests/support/test_devices.h"
#include "tests/support/training_scene.h"
#include "tests/support/training_steps.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

const double not_a_number = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("a frame that gives no finite gradient is skipped and counted, and its cause named") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Config config = tiny_config();
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  ChangedCapture capture;
  capture.change_pose = [](int frame, Pose& pose) {
    if (frame == 2) pose.axis_angles[4].x() = not_a_number;
  };
  Trainer trainer(device, config, capture, run);
  int skipped = 0;
  double last_loss = 0;
  std::vector<std::string> causes;
  trainer.run(budget_of(18), [&](const TrainingReport& report) {
    if (report.skipped > skipped) CHECK_FALSE(report.skip_cause.empty());
    if (!report.skip_cause.empty()) causes.push_back(report.skip_cause);
    skipped = report.skipped;
    if (std::isfinite(report.losses.at("loss"))) last_loss = report.losses.at("loss");
  });
  CHECK(skipped == 3);          // once each of three epochs of six frames
  REQUIRE(causes.size() == 3);  // each told once
  for (const std::string& cause : causes) {
    CHECK_THAT(cause, Contains("was skipped (frame 2, cam0") && Contains("the gradient of '") &&
                          Contains("nor is the registered pose, ") && Contains("the loss's term offset"));
  }
  CHECK(causes[0] != causes[1]);  // another step
  CHECK(std::isfinite(last_loss));
  CHECK(history_of(run).size() == 18);  // NaN is no JSON: such losses are null
  const Checkpoint checkpoint = read_checkpoint(run.checkpoint_file());
  for (const auto& [name, values] : checkpoint.arrays) {
    const bool finite = std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
    CAPTURE(name);
    CHECK(finite);
  }
}

TEST_CASE("looking for a skipped step's cause changes neither what is trained nor what memory is held") {
  const auto train_with = [](int64_t log_every) {
    Config config = tiny_config();
    config.train.log_every = log_every;
    const TemporaryFolder folder;
    const RunFolder run = make_run(folder / "run", config);
    ChangedCapture capture;
    capture.change_pose = [](int frame, Pose& pose) {
      if (frame == 2) pose.axis_angles[4].x() = not_a_number;
    };
    Trainer trainer(wide(), config, capture, run);
    trainer.run(budget_of(6), ignore);  // each frame once
    const size_t held = wide().memory_statistics().bytes_held;
    trainer.run(budget_of(18), ignore);
    CHECK(wide().memory_statistics().bytes_held == held);
    CHECK(trainer.skipped_steps() == 3);
    return read_checkpoint(run.checkpoint_file()).arrays;
  };
  const bool same = train_with(1) == train_with(0);
  CHECK(same);
}

TEST_CASE("a skipped step at the end of a run, or where a checkpoint is due, does not cost the steps before it") {
  Config config = tiny_config();
  config.train.checkpoint_every = 3;
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  bool broken = false;
  ChangedCapture capture;
  capture.change_pose = [&](int, Pose& pose) {
    if (broken) pose.axis_angles[4].x() = not_a_number;
  };
  const auto saved_step = [&] { return read_checkpoint(run.checkpoint_file()).header.at("step").get<int64_t>(); };
  Trainer trainer(wide(), config, capture, run);
  trainer.run(budget_of(2), ignore);
  broken = true;
  trainer.run(budget_of(4), ignore);  // of steps 3 and 4 the first is when a checkpoint is due
  CHECK(trainer.skipped_steps() == 2);
  CHECK(saved_step() == 4);
}

TEST_CASE("training that has broken down stops, and the last good checkpoint stands") {
  Config config = tiny_config();
  config.train.max_skipped_steps = 4;
  config.train.log_every = GENERATE(1, 0, 100);
  config.train.checkpoint_every = 1;
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  bool broken = false;
  ChangedCapture capture;
  capture.change_pose = [&](int, Pose& pose) {
    if (broken) pose.axis_angles[4].x() = not_a_number;
  };
  {
    Trainer trainer(wide(), config, capture, run);
    trainer.run(budget_of(6), ignore);
  }
  const std::string good = file_text(run.checkpoint_file());
  broken = true;
  Trainer trainer(wide(), config, capture, run);
  trainer.resume();
  CHECK_THROWS_WITH(train(trainer, config), Contains("4 steps in a row") &&
                                                Contains("the last good checkpoint stands") &&
                                                Contains("train.learning_rate"));
  CHECK(trainer.step() < 6 + 2 * 4);
  const bool stands = file_text(run.checkpoint_file()) == good;
  CHECK(stands);
}

TEST_CASE("a loss spike is skipped; training that does nothing but spike stops, and tells where the spike is") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  Config config = tiny_config();
  config.train.max_skipped_steps = 5;
  config.train.checkpoint_every = 1;
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  const auto capture = open_scene();
  Trainer trainer(device, config, *capture, run);
  int skipped = 0;
  const auto watch = [&](const TrainingReport& report) { skipped = report.skipped; };
  trainer.run(budget_of(24), watch);
  CHECK(skipped == 0);
  // Scales of exp(20) times their base: the term that holds them is as large, and finite.
  HeadBias scales(trainer, "head.rotation_scale", 4);
  scales.add(20);
  trainer.run(budget_of(25), watch);
  CHECK(skipped == 1);
  scales.add(-20);
  trainer.run(budget_of(26), watch);
  CHECK(skipped == 1);
  const std::string good = file_text(run.checkpoint_file());
  scales.add(20);
  CHECK_THROWS_WITH(trainer.run(budget_of(100), watch),
                    Contains("5 steps in a row were skipped; step ") && Contains("its gradient's norm ") &&
                        Contains(" times the largest of late, most of it of '") &&
                        Contains("the loss's largest term is scale, ") && Contains("train.spike_limit") &&
                        Contains("the last good checkpoint stands"));
  const bool same = file_text(run.checkpoint_file()) == good;
  CHECK(same);

  // What the message advises can be done: the run goes on with it.
  config.train.spike_limit = 0;
  config.train.learning_rate /= 2;
  Trainer advised(device, config, *capture, run);
  advised.resume();
  HeadBias(advised, "head.rotation_scale", 4).add(20);
  advised.run(budget_of(30), watch);
  CHECK(skipped == 1);
}

TEST_CASE("a learning rate far too high ends in an Error, not in an endless run") {
  Config config = tiny_config();
  config.train.learning_rate = 1e30;
  config.train.max_skipped_steps = 5;
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  const auto capture = open_scene();
  Trainer trainer(wide(), config, *capture, run);
  CHECK_THROWS_WITH(train(trainer, config), Contains("steps in a row were skipped; step ") &&
                                                Contains("is not finite") && Contains("no checkpoint yet"));
}

TEST_CASE("parameters that are not finite stop training too") {
  Config config = tiny_config();
  config.train.max_skipped_steps = 3;
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  const auto capture = open_scene();
  {
    Trainer trainer(wide(), config, *capture, run);
    train(trainer, config, 2);
  }
  Checkpoint checkpoint = read_checkpoint(run.checkpoint_file());
  checkpoint.arrays[0].second[0] = static_cast<float>(not_a_number);
  write_checkpoint(run.checkpoint_file(), checkpoint);
  Trainer trainer(wide(), config, *capture, run);
  trainer.resume();
  CHECK_THROWS_WITH(train(trainer, config),
                    Contains("3 steps in a row") && Contains("the parameter '" + checkpoint.arrays[0].first + "'"));
}

TEST_CASE("a picture that cannot be read ends training, and what was trained before it is saved") {
  const Config config = tiny_config();
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  std::atomic<int> loaded = 0;
  ChangedCapture capture;
  capture.change_sample = [&](Sample&) {
    if (++loaded > 9) throw Error("pictures/7.png: cannot be read");  // in the fifth step, of two views each
  };
  Trainer trainer(wide(), config, capture, run);
  CHECK_THROWS_WITH(train(trainer, config), Contains("pictures/7.png: cannot be read"));
  CHECK(read_checkpoint(run.checkpoint_file()).header.at("step") == 4);
  // A run that has trained nothing yet leaves nothing that stands in another's way.
  const RunFolder other = make_run(folder / "other", config);
  CHECK_THROWS_AS(train(*std::make_unique<Trainer>(wide(), config, capture, other), config), Error);
  CHECK_FALSE(other.has_checkpoint());
}

TEST_CASE("a device without enough memory gives an Error, and what was saved stays") {
  const Config config = tiny_config();
  const TemporaryFolder folder;
  const RunFolder run = make_run(folder / "run", config);
  const auto capture = open_scene();
  DeviceOptions options;
  options.kernel_set = KernelSet::Wide;
  size_t for_trainer = 0;
  {
    Device device(options);
    Trainer trainer(device, config, *capture, run);
    for_trainer = device.memory_statistics().bytes_held;
    train(trainer, config, 2);
    CHECK(device.memory_statistics().bytes_held > for_trainer + (size_t{4} << 20));
  }
  const std::string saved = file_text(run.checkpoint_file());
  SECTION("in a step") {
    options.memory_limit = for_trainer + (size_t{2} << 20);
    Device device(options);
    Trainer trainer(device, config, *capture, run);
    trainer.resume();
    CHECK_THROWS_AS(train(trainer, config), Error);
    CHECK_THROWS_WITH(train(trainer, config), Contains("device out of memory") && Contains("views_per_step"));
  }
  SECTION("before the first") {
    options.memory_limit = size_t{2} << 20;
    Device device(options);
    CHECK_THROWS_WITH(Trainer(device, config, *capture, run), Contains("device out of memory"));
  }
  const bool untouched = file_text(run.checkpoint_file()) == saved;
  CHECK(untouched);
}
