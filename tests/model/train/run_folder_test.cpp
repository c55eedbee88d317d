#include "model/train/run_folder.h"

#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "host/error.h"
#include "tests/support/catch.h"

using namespace degas;
namespace fs = std::filesystem;

namespace {

fs::path fresh_folder() {
  const fs::path folder = fs::temp_directory_path() / ("degas_run_folder_test_" + std::to_string(getpid()));
  fs::remove_all(folder);
  fs::create_directories(folder);
  std::ofstream(folder / "body_source.npz") << "body";
  return folder;
}

std::string text_of(const fs::path& path) {
  std::ifstream stream(path);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

TEST_CASE("a run folder holds config and body, and is never overwritten once trained") {
  const fs::path folder = fresh_folder();
  const RunFolder run(folder / "run");
  run.create(Config{}, folder / "body_source.npz");
  CHECK(text_of(run.body_file()) == "body");
  CHECK_NOTHROW(load_config(run.config_file()));
  CHECK_THROWS_WITH(run.require_trained(), Catch::Contains("checkpoint.bin"));
  std::ofstream(run.checkpoint_file()) << "state";
  CHECK_NOTHROW(run.require_trained());
  CHECK_THROWS_WITH(run.create(Config{}, folder / "body_source.npz"), Catch::Contains("--resume"));
  CHECK(text_of(run.checkpoint_file()) == "state");
  CHECK_THROWS_WITH(RunFolder(folder / "other").create(Config{}, folder / "absent.npz"), Catch::Contains("absent.npz"));
}

TEST_CASE("history after the checkpoint's step is dropped, and so is a line that a kill cut") {
  const fs::path folder = fresh_folder();
  const RunFolder run(folder / "run");
  run.create(Config{}, folder / "body_source.npz");
  for (int step : {10, 20, 30}) run.append_history({{"step", step}, {"loss", 0.5}});
  std::ofstream(run.history_file(), std::ios::app) << "{\"step\": 40, \"lo";
  run.truncate_history(20);
  CHECK(text_of(run.history_file()) == "{\"loss\":0.5,\"step\":10}\n{\"loss\":0.5,\"step\":20}\n");
  run.append_history({{"step", 30}});
  run.truncate_history(1000);
  CHECK(text_of(run.history_file()).ends_with("{\"step\":30}\n"));
  fs::remove(run.history_file());
  fs::create_directory(run.history_file());
  CHECK_THROWS_WITH(run.append_history({{"step", 40}}), Catch::Contains("history.jsonl: cannot be written"));
}

TEST_CASE("a run goes on with the body that it was created with, and with no other") {
  const fs::path folder = fresh_folder();
  const RunFolder run(folder / "run");
  run.create(Config{}, folder / "body_source.npz");
  std::ofstream(run.checkpoint_file()) << "state";
  CHECK_NOTHROW(run.require_same_body(folder / "body_source.npz"));
  std::ofstream(folder / "body_source.npz") << "bodY";
  CHECK_THROWS_WITH(run.require_same_body(folder / "body_source.npz"), Catch::Contains("another body"));
  CHECK_THROWS_WITH(run.require_same_body(folder / "absent.npz"), Catch::Contains("absent.npz"));
}

TEST_CASE("what killed processes left of the run's own files goes; all else stays") {
  const fs::path folder = fresh_folder();
  const RunFolder run(folder);
  const pid_t dead = fork();
  if (dead == 0) _exit(0);
  waitpid(dead, nullptr, 0);
  const std::string gone = std::to_string(dead), alive = std::to_string(getpid());
  const std::vector<std::string> leftovers = {".checkpoint." + gone + "-0.tmp.bin", ".config." + gone + "-12.tmp.json",
                                              ".history." + gone + "-3.tmp.jsonl"};
  const std::vector<std::string> others = {".checkpoint." + alive + "-0.tmp.bin",
                                           ".film." + gone + "-0.tmp.mp4",
                                           ".checkpoint.mine.tmp.bin",
                                           "checkpoint.bin",
                                           ".checkpoint..tmp.bin",
                                           ".checkpoint." + gone + "-0x.tmp.bin"};
  for (const std::string& name : leftovers) std::ofstream(folder / name) << "part";
  for (const std::string& name : others) std::ofstream(folder / name) << "kept";
  run.remove_leftovers();
  for (const std::string& name : leftovers) CHECK_FALSE(fs::exists(folder / name));
  for (const std::string& name : others) CHECK(text_of(folder / name) == "kept");
}

TEST_CASE("a damaged checkpoint falls back to the one before, and never takes its place") {
  const fs::path folder = fresh_folder();
  const RunFolder run(folder / "run");
  run.create(Config{}, folder / "body_source.npz");
  const auto at_step = [](int step) { return Checkpoint{{{"step", step}}, {{"weights", {1, 2, 3}}}}; };
  const auto step_of = [](const Checkpoint& checkpoint) { return checkpoint.header.at("step").get<int>(); };
  run.save(at_step(1));
  CHECK_FALSE(fs::exists(run.previous_checkpoint_file()));
  run.save(at_step(2));
  CHECK(step_of(run.newest_checkpoint()) == 2);
  CHECK(step_of(read_checkpoint(run.previous_checkpoint_file())) == 1);

  const bool cut = GENERATE(true, false);
  if (cut) {
    fs::resize_file(run.checkpoint_file(), fs::file_size(run.checkpoint_file()) - 5);
  } else {
    fs::remove(run.checkpoint_file());
  }
  CHECK(run.has_checkpoint());
  CHECK_NOTHROW(run.require_trained());
  CHECK(step_of(run.newest_checkpoint()) == 1);
  CHECK(run.newest_checkpoint().file == run.previous_checkpoint_file());
  CHECK(fs::exists(run.checkpoint_file()) == cut);  // reading changes nothing
  CHECK(step_of(run.checkpoint_to_resume()) == 1);
  CHECK(fs::exists(folder / "run" / "checkpoint.damaged.bin") == cut);
  run.save(at_step(3));
  CHECK(step_of(run.newest_checkpoint()) == 3);
  CHECK(step_of(read_checkpoint(run.previous_checkpoint_file())) == 1);

  std::ofstream(run.checkpoint_file()) << "x";
  std::ofstream(run.previous_checkpoint_file()) << "y";
  CHECK_THROWS_WITH(run.newest_checkpoint(), Catch::Contains("checkpoint.bin: "));
}
