#include <signal.h>

#include "tests/support/catch.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

TEST_CASE("degas pack makes a file that degas train trains from") {
  const TemporaryFolder folder;
  const fs::path pack = folder / "P1C1.pack";
  const ProgramResult made =
      run_program({"pack", "--data", (training_scene() / "P1C1").string(), "--out", pack.string()});
  CAPTURE(made.output, made.errors);
  REQUIRE(made.exit_code == 0);
  CHECK(made.errors.empty());
  CHECK_THAT(made.output, Contains("6 frames, 5 cameras, 30 pictures") && Contains("pictures/s") && Contains("ETA"));

  TrainCommand train(folder, tiny_config());
  train.data = pack;
  train.more = {"--iterations", "2"};
  const ProgramResult trained = train();
  CAPTURE(trained.output, trained.errors);
  CHECK(trained.exit_code == 0);
  const auto run = [&](const std::vector<std::string>& arguments) {
    const ProgramResult result = run_program(arguments);
    CAPTURE(result.output, result.errors);
    CHECK(result.exit_code == 0);
  };
  const std::string data = pack.string(), trained_run = train.run.string();
  run({"eval", "--run", trained_run, "--data", data, "--cameras", "cam02", "--out", (folder / "eval").string()});
  run({"export", "--run", trained_run, "--data", data, "--frame", "0", "--out", (folder / "a.ply").string()});
  run({"inspect", "--data", data, "--out", (folder / "inspect").string()});
  train.data = training_scene() / "P1C1";
  train.more = {"--iterations", "3", "--resume"};
  const ProgramResult resumed = train();
  CAPTURE(resumed.output, resumed.errors);
  CHECK(resumed.exit_code == 0);
  CHECK_THAT(resumed.output, Contains("continuing"));
  train.data = pack;
  const ProgramResult encoding = run_program({"encode-faces", "--data", data, "--onnx", "none.onnx"});
  CHECK(encoding.exit_code == 2);
  CHECK_THAT(encoding.errors, Contains("P1C1.pack: is a pack; encode its capture's faces"));
  // It has no pictures of its own in the cache, and goes on only with the scale it was packed at.
  train.more = {"--iterations", "2", "--set", "data.image_scale=0.5", "--resume"};
  const ProgramResult refused = train();
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.errors, Contains("were packed at image_scale 1, but data.image_scale is 0.5"));

  fs::resize_file(pack, fs::file_size(pack) / 2);
  train.more = {"--iterations", "2"};
  const ProgramResult cut = train();
  CHECK(cut.exit_code == 2);
  CHECK_THAT(cut.errors, Contains("P1C1.pack: has ") && Contains("cut short"));
  CHECK(std::count(cut.errors.begin(), cut.errors.end(), '\n') == 1);
}

TEST_CASE("a pack of some frames and cameras trains, and holds no others") {
  const TemporaryFolder folder;
  const fs::path pack = folder / "part.pack";
  const auto packed = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"pack", "--data", (training_scene() / "P1C1").string(), "--out", pack.string()};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words);
  };
  const ProgramResult made = packed({"--frames", "1:6:2", "--cameras", "cam03,cam00,cam01"});
  CAPTURE(made.output, made.errors);
  REQUIRE(made.exit_code == 0);
  CHECK_THAT(made.output, Contains("3 frames, 3 cameras, 9 pictures"));
  TrainCommand train(folder, tiny_config());
  train.data = pack;
  train.more = {"--iterations", "2", "--hold-out", "cam03"};
  const ProgramResult trained = train();
  CAPTURE(trained.output, trained.errors);
  CHECK(trained.exit_code == 0);

  fs::remove(pack);
  check_refused(packed({"--cameras", "cam09"}), {"--cameras", "cam09"});
  check_refused(packed({"--frames", "4,99"}), {"--frames", "99"});
  CHECK_FALSE(fs::exists(pack));
}

TEST_CASE("degas pack says what it cannot pack, and writes nothing then") {
  const TemporaryFolder folder;
  const std::string data = (training_scene() / "P1C1").string();
  const ProgramResult to_folder = run_program({"pack", "--data", data, "--out", folder.path().string()});
  CHECK(to_folder.exit_code == 2);
  CHECK_THAT(to_folder.errors, Contains("is a folder; --out names the file to write"));
  const ProgramResult of_nothing =
      run_program({"pack", "--data", (folder / "none").string(), "--out", (folder / "a").string()});
  CHECK(of_nothing.exit_code == 2);
  CHECK_THAT(of_nothing.errors, Contains("none: no such folder"));
  CHECK(fs::is_empty(folder.path()));
}

TEST_CASE("Ctrl-C leaves no half-written pack") {
  const TemporaryFolder folder, source;
  // Long enough to be interrupted: at every moment the file is whole or not there.
  REQUIRE(run_program({"synth", "--out", source.path().string(), "--frames", "40", "--novel-frames", "1", "--views",
                       "5", "--width", "320", "--height", "320"})
              .exit_code == 0);
  for (const int milliseconds : {30, 120, 300}) {
    RunningProgram program({"pack", "--data", (source / "P1C1").string(), "--out", (folder / "a.pack").string()});
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
    program.send(SIGINT);
    const ProgramResult result = program.wait();
    CAPTURE(milliseconds, result.output, result.errors);
    for (const auto& entry : fs::directory_iterator(folder.path())) {
      CHECK(entry.path().filename() == "a.pack");
      CHECK_THAT(result.output, Contains("wrote "));
    }
    fs::remove(folder / "a.pack");
  }
}
