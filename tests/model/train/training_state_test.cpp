#include "model/train/training_state.h"

#include "host/error.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

/// An optimiser with a parameter of each rule.
struct TrainedPair {
  Tensor weights, pose;
  Optimiser optimiser;

  explicit TrainedPair(Device& device)
      : weights(random_tensor(device, {17}, 1)), pose(random_tensor(device, {6}, 2)), optimiser(device) {
    optimiser.add("pose", pose, 1, UpdateRule::Rprop);
    optimiser.add("weights", weights);
  }

  void step(unsigned seed) {
    weights.set_gradient(random_tensor(weights.device(), weights.shape(), seed));
    pose.set_gradient(random_tensor(pose.device(), pose.shape(), seed + 1));
    optimiser.step({1e-2, 1e-3});
  }
};

}  // namespace

TEST_CASE("an optimiser goes on from a checkpoint to the same bits") {
  const auto set = GENERATE(from_range(kernel_sets()));
  TrainedPair trained(device(set)), other(device(set));
  trained.step(3);
  trained.step(5);
  Checkpoint checkpoint;
  store_optimiser(trained.optimiser, checkpoint);
  restore_optimiser(other.optimiser, checkpoint);
  trained.step(7);
  other.step(7);
  CHECK(other.weights.to_host<float>() == trained.weights.to_host<float>());
  CHECK(other.pose.to_host<float>() == trained.pose.to_host<float>());
}

TEST_CASE("what another rule left behind in a checkpoint is not taken for this rule's steps") {
  // Before poses were refined by Rprop, checkpoints named no rules: all was Adam's.
  const auto set = GENERATE(from_range(kernel_sets()));
  TrainedPair trained(device(set)), other(device(set)), fresh(device(set));
  trained.step(3);
  trained.step(5);
  Checkpoint checkpoint;
  store_optimiser(trained.optimiser, checkpoint);
  checkpoint.header.at("optimiser").erase("rules");
  restore_optimiser(other.optimiser, checkpoint);
  CHECK(other.pose.to_host<float>() == trained.pose.to_host<float>());

  fresh.pose.upload(std::span<const float>(trained.pose.to_host<float>()));
  trained.step(7);
  other.step(7);
  fresh.step(7);
  CHECK(other.weights.to_host<float>() == trained.weights.to_host<float>());
  CHECK(other.pose.to_host<float>() == fresh.pose.to_host<float>());
  CHECK(other.pose.to_host<float>() != trained.pose.to_host<float>());
}

TEST_CASE("a checkpoint of another number of parameters is refused") {
  TrainedPair trained(device(KernelSet::Wide));
  trained.step(3);
  Checkpoint checkpoint;
  checkpoint.file = "run/checkpoint.bin";
  store_optimiser(trained.optimiser, checkpoint);
  checkpoint.header.at("optimiser").at("updates").push_back(1);
  CHECK_THROWS_WITH(restore_optimiser(trained.optimiser, checkpoint),
                    Catch::Contains("run/checkpoint.bin: its optimiser has 3 parameters with 2 rules, "
                                    "this configuration's has 2"));
}

TEST_CASE("an optimiser's numbers that are none, or lie where none can, are refused by file and key") {
  TrainedPair trained(device(KernelSet::Wide));
  trained.step(3);
  Checkpoint checkpoint;
  checkpoint.file = "run/checkpoint.bin";
  store_optimiser(trained.optimiser, checkpoint);
  nlohmann::json& saved = checkpoint.header.at("optimiser");
  const auto refused = [&](const std::string& what) {
    CHECK_THROWS_WITH(restore_optimiser(trained.optimiser, checkpoint),
                      Catch::Contains("run/checkpoint.bin: '" + what) && Catch::Contains("use an older copy"));
  };
  SECTION("a fraction of an update") {
    saved["updates"][0] = 1.5;
    refused("updates' has 1.5, expected 0 to 2147483647");
  }
  SECTION("more updates than there can be") {
    saved["updates"][1] = int64_t{1} << 40;
    refused("updates' has 1099511627776");
  }
  SECTION("no list") {
    saved["updates"] = 3;
    refused("updates' is no list of numbers");
  }
  SECTION("a step not taken") {
    saved["skipped"] = -1;
    refused("skipped' has -1");
  }
  SECTION("a norm that is a word") {
    saved["log_largest_norm"] = "large";
    refused("log_largest_norm' has \"large\"");
  }
}
