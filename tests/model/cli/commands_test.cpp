#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/io/ply.h"
#include "host/io/video.h"
#include "tests/support/catch.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

size_t files_in(const fs::path& folder) {
  return static_cast<size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

}  // namespace

TEST_CASE("every command explains itself") {
  const ProgramResult all = run_program({"--help"});
  CHECK(all.exit_code == 0);
  for (const std::string command :
       {"devices", "synth", "inspect", "encode-faces", "train", "eval", "render", "export", "ablate", "pareto", "report"}) {
    CHECK_THAT(all.output, Contains(command));
    const ProgramResult result = run_program({command, "--help"});
    CHECK(result.exit_code == 0);
    CHECK(result.errors.empty());
    CHECK_THAT(result.output, Contains("--help"));
    CHECK(result.output.size() > 100);
  }
  CHECK(run_program({}).exit_code == 2);
  CHECK(run_program({"trian"}).exit_code == 2);
  CHECK(run_program({"train", "--nonsense"}).exit_code == 2);
  CHECK(run_program({"train"}).exit_code == 2);
  const ProgramResult devices = run_program({"devices"});
  CHECK(devices.exit_code == 0);
  CHECK_THAT(devices.output, Contains("[0] ") && Contains("compute units"));
}

TEST_CASE("synth, train, eval, render, export and report work together") {
  const TemporaryFolder folder;
  const auto must = [](const std::vector<std::string>& arguments) {
    const ProgramResult result = run_program(arguments);
    CAPTURE(arguments, result.output, result.errors);
    CHECK(result.exit_code == 0);
    return result.output;
  };
  Config config = tiny_config();
  config.train.iterations = 6;
  config.train.refine_poses = true;
  TrainCommand train(folder, config);
  train.data = folder / "capture/P1C1";
  train.body = folder / "capture/body.npz";
  train.more = {"--hold-out", "cam02"};
  must({"synth", "--out", folder / "capture", "--frames", "3", "--novel-frames", "2", "--views", "4", "--width", "64",
        "--height", "80"});
  must(train.arguments());
  const std::string run = train.run, view = folder / "view", novel = folder / "novel", cache = folder / "cache",
                    seen = folder / "capture/P1C1", unseen = folder / "capture/P1C2";

  CHECK_THAT(must({"eval", "--run", run, "--data", seen, "--out", view, "--frames", "0,2", "--cache", cache}),
             Contains("2 of 2 pictures are of frames whose pose training refined"));
  CHECK(nlohmann::json::parse(file_text(folder / "view/metrics.json")).at("refined_pictures") == 2);
  CHECK(files_in(folder / "view/render") == 2);
  CHECK(fs::exists(folder / "view/truth/cam02_000002.png"));
  CHECK_THAT(
      must({"eval", "--run", run, "--data", unseen, "--out", novel, "--cameras", "cam01,cam02", "--cache", cache}),
      Contains("registered poses are used") && !Contains("drawn with the refined pose"));
  CHECK(files_in(folder / "novel/sheets") == 4);

  must({"render", "--run", run, "--data", unseen, "--camera", "cam01", "--out", folder / "frames", "--cache", cache});
  CHECK(files_in(folder / "frames") == 2);
  CHECK(read_image(folder / "frames/000001.png").width == 64);
  must({"render", "--run", run, "--data", unseen, "--cameras", "cam01:cam03", "--frames", "1", "--format", "dreams",
        "--out", folder / "views", "--cache", cache});
  CHECK(read_image(folder / "views/cam02/000001.png").width == 64);
  CHECK(files_in(folder / "views/cam01") == 1);
  must({"render", "--run", run, "--data", seen, "--turntable", "--out", folder / "films/turn.mp4", "--cache", cache});
  CHECK(VideoReader(folder / "films/turn.mp4").frame_count() == 3);

  must({"export", "--run", run, "--data", unseen, "--frame", "1", "--out", folder / "avatar.ply", "--cache", cache});
  CHECK(read_ply(folder / "avatar.ply").opacity_logits.size() > 1000);
  CHECK(fs::exists(folder / "avatar.exr"));
  must({"report", "--run", run, "--evaluation", view, "--evaluation", novel, "--out", folder / "report.html"});
  CHECK_THAT(file_text(folder / "report.html"), Contains("data:image/png;base64,"));
}

TEST_CASE("what a command cannot read or write it says in one line") {
  const TemporaryFolder folder;
  Config config = tiny_config();
  config.train.iterations = 1;
  TrainCommand train(folder, config);
  REQUIRE(train().exit_code == 0);
  const std::string run = train.run, seen = train.data, file = train.config, cache = training_scene() / "cache";
  const auto refused = [&](std::vector<std::string> arguments, const std::string& part) {
    arguments.insert(arguments.end(), {"--data", seen, "--cache", cache});
    const ProgramResult result = run_program(arguments);
    CAPTURE(arguments, result.errors);
    CHECK(result.exit_code == 2);
    CHECK(result.errors.rfind("degas: ", 0) == 0);
    CHECK(std::count(result.errors.begin(), result.errors.end(), '\n') == 1);
    CHECK_THAT(result.errors, Contains(part));
  };
  const std::string none = folder / "none", out = folder / "out";
  refused({"eval", "--run", none, "--out", out}, "none: no checkpoint.bin: not the folder of a trained run");
  refused({"eval", "--run", run, "--out", file + "/x"}, "config.json/x");
  refused({"eval", "--run", run, "--out", out, "--cameras", "cam9"},
          "--cameras: no camera 'cam9'; cameras here: cam00");
  refused({"eval", "--run", run, "--out", out, "--frames", "0:7"}, "--frames: '0:7' lies outside the capture");
  refused({"render", "--run", run, "--out", file + "/x"}, "config.json");
  refused({"render", "--run", run, "--out", out, "--camera", "cam9"}, "--cameras: no camera 'cam9'");
  refused({"render", "--run", run, "--out", file + "/x.mp4"}, "config.json");
  refused({"render", "--run", run, "--out", folder / "x.mp4", "--cameras", "cam00,cam01"}, "a video shows one camera");
  refused({"export", "--run", run, "--out", out, "--frame", "6"}, "--frame 6: the capture has frames 0 .. 5");
  refused({"export", "--run", run, "--out", file + "/x.ply", "--frame", "0"}, "config.json");
}
