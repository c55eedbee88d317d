#include "host/ops/splat.h"
#include "model/train/trained_avatar.h"
#include "model/train/trainer.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;

namespace {

/// MiB that a device holds once the run's trainer or avatar is on it: enough to start with, too little to go on.
template <typename Load>
std::string enough_to_start(Load load) {
  Device device;
  load(device);
  return std::to_string((device.memory_statistics().bytes_held >> 20) + 1);
}

/// What the line must hold; the device is the one that the program takes by itself.
std::vector<std::string> refusal() {
  return {"device out of memory: ", " MiB asked for",  "--memory-limit ",
          "lower net.resolution",   "raise the limit", Device().description().name};
}

}  // namespace

TEST_CASE("training beyond --memory-limit is refused, and the run goes on once there is memory again") {
  const TemporaryFolder whole_folder, folder;
  Config config = tiny_config();
  config.train.iterations = 6;
  const TrainCommand whole(whole_folder, config);
  TrainCommand train(folder, config);
  REQUIRE(whole().exit_code == 0);
  const auto with = [&](std::vector<std::string> more) {
    train.more = std::move(more);
    return train();
  };
  check_refused(with({"--memory-limit", "1"}), refusal());
  REQUIRE(with({"--iterations", "3"}).exit_code == 0);
  const auto before = files_of(train.run);
  const std::string in_a_step = enough_to_start([&](Device& device) {
    const auto capture = open_scene();
    Trainer(device, config, *capture, RunFolder(train.run));
  });
  check_refused(with({"--resume", "--iterations", "3", "--memory-limit", "1"}), refusal());
  const bool untouched = files_of(train.run) == before;
  CHECK(untouched);
  check_refused(with({"--resume", "--memory-limit", in_a_step}), refusal());
  const auto after = files_of(train.run);
  for (const char* name : {"checkpoint.bin", "history.jsonl", "body.npz"}) {
    CAPTURE(name);
    const bool same = after.at(name) == before.at(name);
    CHECK(same);
  }
  CHECK(with({"--resume", "--memory-limit", "1000"}).exit_code == 0);
  const bool same_bits = file_text(train.run / "checkpoint.bin") == file_text(whole.run / "checkpoint.bin");
  CHECK(same_bits);
}

TEST_CASE("what uses a trained avatar beyond --memory-limit is refused, and earlier results stay") {
  const TemporaryFolder folder;
  Config config = tiny_config();
  config.train.iterations = 2;
  TrainCommand train(folder, config);
  REQUIRE(train().exit_code == 0);
  const std::vector<std::string> command = GENERATE(values<std::vector<std::string>>(
      {{"eval", "view"}, {"render", "film.mp4"}, {"render", "frames"}, {"export", "avatar.ply", "--frame", "0"}}));
  std::filesystem::create_directory(folder / "out");
  const auto run = [&](const std::string& limit) {
    std::vector<std::string> words = {command[0], "--out", folder / ("out/" + command[1])};
    words.insert(words.end(), command.begin() + 2, command.end());
    words.insert(words.end(), {"--run", train.run, "--data", train.data, "--cache", training_scene() / "cache",
                               "--memory-limit", limit});
    ProgramResult result = run_program(words);
    // Where there are no LPIPS weights, eval says so first.
    if (result.errors.rfind("degas: no LPIPS", 0) == 0) result.errors.erase(0, result.errors.find('\n') + 1);
    return result;
  };
  REQUIRE(run("1000").exit_code == 0);
  const auto files = [&] {
    std::map<std::string, std::string> texts;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "out"))
      if (entry.is_regular_file()) texts[entry.path()] = file_text(entry.path());
    return texts;
  };
  const auto before = files();
  CHECK_FALSE(before.empty());
  check_refused(run("1"), refusal());
  check_refused(run(enough_to_start([&](Device& device) { TrainedAvatar(device, RunFolder(train.run)); })), refusal());
  const bool untouched = files() == before;
  CHECK(untouched);
}

TEST_CASE("the memory limit is explained, and must be a number of MiB above 0") {
  for (const char* command : {"train", "eval", "render", "export"}) {
    CHECK_THAT(run_program({command, "--help"}).output, Catch::Contains("--memory-limit") && Catch::Contains("MiB"));
    for (const char* value : {"0", "-4", "much"}) {
      CAPTURE(command, value);
      const ProgramResult result = run_program({command, "--memory-limit", value});
      CHECK(result.exit_code == 2);
      CHECK_THAT(result.errors, Catch::Contains("--memory-limit"));
    }
  }
}
