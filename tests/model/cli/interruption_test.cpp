#include <signal.h>

#include <nlohmann/json.hpp>

#include "host/io/checkpoint.h"
#include "tests/support/catch.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

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

TEST_CASE("a run that one process trains is refused to another, which leaves it alone") {
  const TemporaryFolder folder;
  Config config = tiny_config();
  config.train.iterations = 1000;
  TrainCommand train(folder, config);
  RunningProgram program(train.arguments());
  REQUIRE(await_lines(program, train.run, 2));
  train.more = {"--resume"};
  check_refused(train(), {train.run.string(), "another process trains this run"});
  const size_t lines = line_count(train.run / "history.jsonl");
  CHECK(await_lines(program, train.run, lines + 2));
  program.send(SIGINT);
  CHECK(program.wait().exit_code == 0);
}

TEST_CASE("a run whose checkpoint is damaged goes on from the one before, to the bits of an undisturbed run") {
  const TemporaryFolder whole_folder, folder;
  Config config = tiny_config();
  config.train.iterations = 8;
  config.train.checkpoint_every = 2;
  TrainCommand whole(whole_folder, config), train(folder, config);
  REQUIRE(whole().exit_code == 0);
  train.more = {"--iterations", "6"};
  REQUIRE(train().exit_code == 0);
  const auto file = train.run / "checkpoint.bin";
  std::string bytes = file_text(file);
  bytes[bytes.size() / 2] ^= 1;
  std::ofstream(file, std::ios::binary) << bytes;
  train.more = {"--resume"};
  const ProgramResult result = train();
  CAPTURE(result.errors);
  CHECK(result.exit_code == 0);
  CHECK_THAT(result.errors, Contains("checkpoint.bin: the checkpoint is corrupt") &&
                                Contains("going back to the one before, checkpoint.previous.bin, step 4"));
  const bool same = file_text(file) == file_text(whole.run / "checkpoint.bin");
  CHECK(same);
  const bool kept = file_text(train.run / "checkpoint.damaged.bin") == bytes;
  CHECK(kept);
  check_history(train.run, 8);
}
