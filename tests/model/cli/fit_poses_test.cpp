#include <nlohmann/json.hpp>

#include "host/io/npz.h"
#include "model/data/smplx_parameters.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;

namespace {

/// A run of a few steps without cam02, of the program itself.
const RunFolder& trained() {
  static const TemporaryFolder folder;
  static const RunFolder run = [] {
    Config config = tiny_config();
    config.train.iterations = 20;
    config.data.hold_out = {"cam02"};
    return train_run(folder / "run", config, *open_scene());
  }();
  return run;
}

ProgramResult run_on_novel(const std::string& command, const std::filesystem::path& output,
                           const std::vector<std::string>& more) {
  std::vector<std::string> words = {command,
                                    "--run",
                                    trained().path().string(),
                                    "--data",
                                    (training_scene() / "P1C2").string(),
                                    "--out",
                                    output.string(),
                                    "--cache",
                                    (training_scene() / "cache").string()};
  words.insert(words.end(), more.begin(), more.end());
  return run_program(words);
}

std::string fitted_cameras(const std::filesystem::path& file) {
  return nlohmann::json::parse(NpzFile(file).read("fit").text()).at("cameras").dump();
}

}  // namespace

TEST_CASE("fit-poses fits a novel sequence without the held-out camera, and eval takes what it wrote") {
  const TemporaryFolder folder;
  const auto poses = folder / "poses.npz";
  const ProgramResult fit = run_on_novel("fit-poses", poses, {});
  CAPTURE(fit.output, fit.errors);
  REQUIRE(fit.exit_code == 0);
  CHECK_THAT(fit.output, Catch::Contains("2 frames fitted to 8 pictures") && Catch::Contains("--poses"));
  CHECK(fitted_cameras(poses) == R"(["cam00","cam01","cam03","cam04"])");

  const std::vector<std::string> cameras = {"--cameras", "cam02"};
  const ProgramResult as_registered = run_on_novel("eval", folder / "registered", cameras);
  REQUIRE(as_registered.exit_code == 0);
  const ProgramResult as_fitted =
      run_on_novel("eval", folder / "fitted", {"--cameras", "cam02", "--poses", poses.string()});
  REQUIRE(as_fitted.exit_code == 0);
  const auto psnr = [&](const char* name) {
    return nlohmann::json::parse(file_text(folder / name / "metrics.json")).at("psnr").get<double>();
  };
  CHECK(psnr("fitted") != psnr("registered"));
}

TEST_CASE("fit-poses goes on with the frames that are missing") {
  const TemporaryFolder folder;
  const auto poses = folder / "poses.npz";
  REQUIRE(run_on_novel("fit-poses", poses, {"--frames", "1"}).exit_code == 0);
  const SmplxParameters first = read_smplx_parameters(poses);
  const ProgramResult resumed = run_on_novel("fit-poses", poses, {"--resume"});
  CAPTURE(resumed.output, resumed.errors);
  REQUIRE(resumed.exit_code == 0);
  CHECK_THAT(resumed.output, Catch::Contains("1 frames fitted to 4 pictures"));
  const SmplxParameters both = read_smplx_parameters(poses);
  CHECK(both.poses[1].axis_angles == first.poses[1].axis_angles);
  CHECK(both.poses[0].axis_angles != first.poses[0].axis_angles);

  check_refused(run_on_novel("fit-poses", poses, {"--resume", "--steps", "7"}),
                {"poses.npz: was fitted by", "leave --resume away"});
  check_refused(run_on_novel("fit-poses", folder / "absent.npz", {"--resume"}), {"absent.npz"});
}

TEST_CASE("fit-poses says that a held-out camera it is told to look at is one no more") {
  const TemporaryFolder folder;
  const ProgramResult fit =
      run_on_novel("fit-poses", folder / "poses.npz", {"--cameras", "cam00:cam03", "--frames", "0", "--steps", "1"});
  CAPTURE(fit.output, fit.errors);
  CHECK(fit.exit_code == 0);
  CHECK_THAT(fit.errors, Catch::Contains("cam02 was held out from training"));
}

TEST_CASE("poses of another capture are refused") {
  const TemporaryFolder folder;
  const auto other = (training_scene() / "P1C1" / "smplx.npz").string();
  check_refused(run_on_novel("eval", folder / "eval", {"--poses", other}),
                {"smplx.npz: has parameters of 6 frames, the capture has 2"});
}
