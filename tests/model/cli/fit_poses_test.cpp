#include <nlohmann/json.hpp>

#include "host/io/checkpoint.h"
#include "host/io/image.h"
#include "host/io/npz.h"
#include "host/io/ply.h"
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

TEST_CASE("poses that were registered beside the person are better fitted") {
  const TemporaryFolder folder;
  SmplxParameters parameters = read_smplx_parameters(training_scene() / "P1C2" / "smplx.npz");
  for (Pose& pose : parameters.poses) pose.translation.x() += 0.03;
  const auto wrong = folder / "wrong.npz", fitted = folder / "fitted.npz";
  write_npz(wrong, smplx_arrays(parameters));
  REQUIRE(run_on_novel("fit-poses", fitted, {"--poses", wrong.string()}).exit_code == 0);
  const auto psnr_with = [&](const std::filesystem::path& poses) {
    const auto output = folder / poses.stem();
    const ProgramResult result = run_on_novel("eval", output, {"--cameras", "cam02", "--poses", poses.string()});
    CAPTURE(result.errors);
    REQUIRE(result.exit_code == 0);
    CHECK(result.errors.find("no unseen camera") == std::string::npos);
    return nlohmann::json::parse(file_text(output / "metrics.json")).at("psnr").get<double>();
  };
  const double before = psnr_with(wrong), after = psnr_with(fitted);
  CAPTURE(before, after);
  CHECK(after > before + 0.5);

  const ProgramResult seen =
      run_on_novel("eval", folder / "seen", {"--cameras", "cam01,cam02", "--poses", fitted.string()});
  CHECK_THAT(seen.errors, Catch::Contains("were fitted to pictures of cam01, which is no unseen camera"));
  // Faces are measured in the boxes of the capture's own registration, whatever poses are drawn.
  CHECK(file_text(folder / "wrong/boxes.json") == file_text(folder / "fitted/boxes.json"));
}

TEST_CASE("render, export and inspect show the poses of a file in place of the registered ones") {
  const TemporaryFolder folder;
  SmplxParameters parameters = read_smplx_parameters(training_scene() / "P1C2" / "smplx.npz");
  const double moved = 0.2;
  for (Pose& pose : parameters.poses) pose.translation.x() += moved;
  const std::string poses = (folder / "moved.npz").string();
  write_npz(poses, smplx_arrays(parameters));
  const auto output_of = [&](const std::string& name, const std::string& command, std::vector<std::string> more) {
    if (name == "moved") more.insert(more.end(), {"--poses", poses});
    const auto output = folder / (name + "_" + command);
    const ProgramResult result = run_on_novel(command, output, more);
    CAPTURE(name, command, result.errors);
    REQUIRE(result.exit_code == 0);
    return output;
  };
  const auto middle = [&](const std::string& name) {
    const std::vector<float> positions = read_ply(output_of(name, "export", {"--frame", "1"})).positions;
    double sum = 0;
    for (size_t i = 0; i < positions.size(); i += 3) sum += positions[i];
    return sum / static_cast<double>(positions.size() / 3);
  };
  CHECK(middle("moved") - middle("own") == Approx(moved).margin(1e-4));

  const auto picture = [&](const std::string& name) {
    return read_image(output_of(name, "render", {"--camera", "cam01", "--frames", "1"}) / "000001.png", 3).pixels;
  };
  CHECK(picture("moved") != picture("own"));

  const auto overlap = [&](const std::string& name) {
    const auto output = folder / (name + "_inspect");
    std::vector<std::string> words = {"inspect",
                                      "--data",
                                      (training_scene() / "P1C2").string(),
                                      "--body",
                                      (training_scene() / "body.npz").string(),
                                      "--out",
                                      output.string()};
    if (name == "moved") words.insert(words.end(), {"--poses", poses});
    REQUIRE(run_program(words).exit_code == 0);
    return nlohmann::json::parse(file_text(output / "inspect.json")).at("mask_iou_mean").get<double>();
  };
  CHECK(overlap("moved") < overlap("own") - 0.2);
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
  // The same as in one go.
  const auto whole = folder / "whole.npz";
  REQUIRE(run_on_novel("fit-poses", whole, {}).exit_code == 0);
  CHECK(read_smplx_parameters(whole).poses[0].axis_angles == both.poses[0].axis_angles);
  CHECK(read_smplx_parameters(whole).poses[1].translation == both.poses[1].translation);

  check_refused(run_on_novel("fit-poses", poses, {}), {"poses.npz: is there already", "--resume"});
  check_refused(run_on_novel("fit-poses", folder.path(), {"--frames", "0"}), {"is a folder"});

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

TEST_CASE("a run trained with other poses goes on with them and not without, and a pack takes them in") {
  const TemporaryFolder folder;
  SmplxParameters parameters = read_smplx_parameters(training_scene() / "P1C1" / "smplx.npz");
  for (Pose& pose : parameters.poses) pose.translation.x() += 0.01;
  const auto poses = (folder / "moved.npz").string();
  write_npz(poses, smplx_arrays(parameters));
  Config config = tiny_config();
  config.train.iterations = 4;
  TrainCommand train(folder, config);
  train.more = {"--poses", poses};
  REQUIRE(train().exit_code == 0);
  train.more = {"--resume", "--iterations", "6"};
  check_refused(train(), {"--poses changed"});
  train.more = {"--resume", "--iterations", "6", "--poses", poses};
  REQUIRE(train().exit_code == 0);

  const auto pack = folder / "moved.pack";
  REQUIRE(
      run_program({"pack", "--data", (training_scene() / "P1C1").string(), "--poses", poses, "--out", pack.string()})
          .exit_code == 0);
  TrainCommand packed(folder, config);
  packed.run = folder / "packed";
  packed.data = pack;
  packed.more = {"--iterations", "6"};
  REQUIRE(packed().exit_code == 0);
  CHECK(read_checkpoint(packed.run / "checkpoint.bin").arrays == read_checkpoint(train.run / "checkpoint.bin").arrays);
}

TEST_CASE("poses of another capture are refused") {
  const TemporaryFolder folder;
  const auto other = (training_scene() / "P1C1" / "smplx.npz").string();
  check_refused(run_on_novel("eval", folder / "eval", {"--poses", other}),
                {"smplx.npz: has parameters of 6 frames, the capture has 2"});
}
