#include <signal.h>

#include <random>

#include "host/io/checkpoint.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
using std::chrono::microseconds;

namespace {

/// Kills a run of so many steps so often at random moments, resumes it each time, and compares what it ends with.
void check_killed(const std::string& kernels, int64_t iterations, int kills) {
  const TemporaryFolder whole_folder, folder;
  Config config = tiny_config();
  // Steps of a few milliseconds and a small checkpoint after each: most of the time goes into starting the program.
  config.net.untied_bias = false;
  config.train.views_per_step = 1;
  config.data.crop_to_person = true;
  config.train.iterations = iterations;
  config.train.checkpoint_every = 1;
  config.train.refine_poses = true;
  TrainCommand whole(whole_folder, config), train(folder, config);
  whole.more = {"--kernels", kernels};
  train.more = {"--kernels", kernels, "--resume"};
  REQUIRE(whole().exit_code == 0);
  std::mt19937 random(1);
  int killed = 0, between_steps = 0;
  for (; killed < kills; ++killed) {
    RunningProgram program(train.arguments());
    // Every third time at once or while it starts; else while it computes, writes its history or saves.
    const size_t lines = line_count(train.run / "history.jsonl");
    const bool starting = killed % 3 == 2;
    if (!starting && !await_lines(program, train.run, lines + 1)) break;
    std::this_thread::sleep_for(microseconds(random() % (starting ? 300000 : 60000)));
    program.send(SIGKILL);
    if (program.wait().ended_by != SIGKILL) break;
    if (!std::filesystem::exists(train.run / "checkpoint.bin")) continue;
    const int64_t saved = read_checkpoint(train.run / "checkpoint.bin").header.at("step");
    between_steps += saved != static_cast<int64_t>(line_count(train.run / "history.jsonl"));
  }
  CHECK(killed == kills);
  CHECK(between_steps > 0);  // so often a step was told and not yet saved: such lines are told again
  const ProgramResult result = train();
  CAPTURE(result.errors);
  CHECK(result.exit_code == 0);
  const bool same = file_text(train.run / "checkpoint.bin") == file_text(whole.run / "checkpoint.bin");
  CHECK(same);
  check_history(train.run, config.train.iterations);
  // Nothing that a kill left half-written lies about.
  for (const auto& [name, text] : files_of(train.run)) {
    CAPTURE(name);
    CHECK(std::filesystem::exists(whole.run / name));
  }
}

}  // namespace

TEST_CASE("killed a hundred times at random moments, a run that resumes ends with the uninterrupted one's bits") {
  check_killed("wide", 400, 100);
}

TEST_CASE("so does a run of the other kernel set that is killed ten times") {
  check_killed("gpu", 60, 10);
}
