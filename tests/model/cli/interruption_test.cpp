#include <signal.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <thread>

#include "host/io/checkpoint.h"
#include "tests/support/catch.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;
using std::chrono::milliseconds;

namespace {

size_t line_count(const fs::path& path) {
  const std::string text = file_text(path);
  return static_cast<size_t>(std::count(text.begin(), text.end(), '\n'));
}

/// Waits until history.jsonl has that many lines; false when the program ends before.
bool await_lines(RunningProgram& program, const fs::path& run, size_t lines) {
  while (line_count(run / "history.jsonl") < lines) {
    if (!program.running()) return false;
    std::this_thread::sleep_for(milliseconds(5));
  }
  return true;
}

void check_history(const fs::path& run, int64_t steps) {
  std::istringstream history(file_text(run / "history.jsonl"));
  int64_t step = 0;
  for (std::string line; std::getline(history, line);) CHECK(nlohmann::json::parse(line).at("step") == ++step);
  CHECK(step == steps);
}

}  // namespace

TEST_CASE("Ctrl-C saves and ends in order; --resume gives the bits of the uninterrupted run") {
  const TemporaryFolder whole_folder, folder;
  Config config = tiny_config();
  config.train.iterations = 40;
  config.train.schedule = LearningRateSchedule::Cosine;
  const TrainCommand whole(whole_folder, config);
  TrainCommand train(folder, config);
  REQUIRE(whole().exit_code == 0);
  const int signal = GENERATE(SIGINT, SIGTERM);
  {
    RunningProgram program(train.arguments());
    REQUIRE(await_lines(program, train.run, 5));
    program.send(signal);
    const ProgramResult result = program.wait();
    CAPTURE(result.errors, result.ended_by);
    CHECK(result.exit_code == 0);
    CHECK_THAT(result.output, Contains("interrupted at step"));
  }
  const int64_t step = read_checkpoint(train.run / "checkpoint.bin").header.at("step");
  CHECK(step >= 5);
  CHECK(step < 40);
  check_history(train.run, step);
  train.more = {"--resume"};
  CHECK(train().exit_code == 0);
  const bool same = file_text(train.run / "checkpoint.bin") == file_text(whole.run / "checkpoint.bin");
  CHECK(same);
  check_history(train.run, 40);
}

TEST_CASE("killed at any moment, --resume gives the bits of the uninterrupted run") {
  const TemporaryFolder whole_folder, folder;
  Config config = tiny_config();
  config.train.iterations = 24;
  config.train.checkpoint_every = 1;
  config.train.refine_poses = true;
  const TrainCommand whole(whole_folder, config);
  TrainCommand train(folder, config);
  REQUIRE(whole().exit_code == 0);
  train.more = {"--resume"};
  std::mt19937 random(1);
  int killed = 0;
  for (; killed < 10; ++killed) {
    RunningProgram program(train.arguments());
    // While it starts, or some steps later: while it computes, saves or writes its history.
    const size_t lines = line_count(train.run / "history.jsonl");
    if (killed % 5 != 2 && !await_lines(program, train.run, lines + 1 + random() % 2)) break;
    std::this_thread::sleep_for(milliseconds(random() % 120));
    program.send(SIGKILL);
    if (program.wait().ended_by != SIGKILL) break;
    if (fs::exists(train.run / "checkpoint.bin")) CHECK_NOTHROW(read_checkpoint(train.run / "checkpoint.bin"));
  }
  CHECK(killed >= 5);
  const ProgramResult result = train();
  CAPTURE(result.errors);
  CHECK(result.exit_code == 0);
  const bool same = file_text(train.run / "checkpoint.bin") == file_text(whole.run / "checkpoint.bin");
  CHECK(same);
  check_history(train.run, 24);
}
