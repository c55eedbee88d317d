#include <nlohmann/json.hpp>

#include "host/device/user_cache.h"
#include "tests/support/catch.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

/// A cache with a tuning table of its own; built programs are the user's, or all would be built anew.
Environment own_cache(const TemporaryFolder& folder) {
  fs::create_directories(cache_folder() / "programs");
  fs::create_directory_symlink(cache_folder() / "programs", folder / "programs");
  return {{"DEGAS_CACHE", folder.path()}};
}

}  // namespace

TEST_CASE("a tuned run gives the same bits again from the same cache, and goes on with what it recorded") {
  const TemporaryFolder cache, whole_folder, folder;
  Config config = tiny_config();
  config.train.iterations = 8;
  config.train.schedule = LearningRateSchedule::Constant;  // of which four steps are the first half of eight
  TrainCommand whole(whole_folder, config), train(folder, config);
  whole.environment = train.environment = own_cache(cache);
  whole.more = train.more = {"--tune", "fast"};
  const ProgramResult first = whole();
  CAPTURE(first.errors);
  REQUIRE(first.exit_code == 0);
  CHECK_THAT(first.output, Contains("launches tuned in"));
  const nlohmann::json choices = nlohmann::json::parse(file_text(cache / "tuning.json")).at("choices");
  CHECK(choices.size() > 10);
  CHECK(nlohmann::json::parse(file_text(whole.run / "tuning.json")).at("choices") == choices);

  train.more = {"--tune", "fast", "--iterations", "4"};
  CHECK_THAT(train().output, Contains("tuning: 0 launches tuned"));
  // Nothing of the cache is left, and nobody says --tune: the record alone says how to go on.
  std::ofstream(cache / "tuning.json", std::ios::trunc) << "{\"version\": 1, \"choi";
  train.more = {"--resume"};
  const ProgramResult resumed = train();
  CHECK(resumed.exit_code == 0);
  CHECK_THAT(resumed.output, Contains("tuning: 0 launches tuned"));
  CHECK_THAT(resumed.errors, Contains("tuning.json: damaged") && Contains("it is made anew"));
  const bool same = file_text(train.run / "checkpoint.bin") == file_text(whole.run / "checkpoint.bin");
  CHECK(same);
}

TEST_CASE("a run that is not tuned reads no cache and records no choice; another mode is refused") {
  const TemporaryFolder cache, folder;
  Config config = tiny_config();
  config.train.iterations = 1;
  TrainCommand train(folder, config);
  train.environment = own_cache(cache);
  std::ofstream(cache / "tuning.json") << "damaged";
  const ProgramResult result = train();
  CHECK(result.exit_code == 0);
  CHECK(result.errors.find("tuner") == std::string::npos);
  CHECK(!fs::exists(train.run / "tuning.json"));
  CHECK(file_text(cache / "tuning.json") == "damaged");
  train.more = {"--tune", "sideways"};
  CHECK(train().exit_code == 2);
}
