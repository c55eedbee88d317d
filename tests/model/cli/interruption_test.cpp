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
