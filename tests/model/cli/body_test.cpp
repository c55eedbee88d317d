#include "tests/support/catch.h"
#include "tests/support/tiny_makehuman.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

std::vector<std::string> body_arguments(const TinyMakeHuman& files, const fs::path& out) {
  return {"body",
          "--from",
          "makehuman",
          "--base",
          files.base.string(),
          "--rig",
          files.rig.string(),
          "--weights",
          files.weights.string(),
          "--targets",
          files.targets.string(),
          "--out",
          out.string()};
}

}  // namespace

TEST_CASE("a body made of MakeHuman's files trains") {
  const TemporaryFolder folder;
  const TinyMakeHuman files(folder / "makehuman");
  std::vector<std::string> arguments = body_arguments(files, folder / "body.npz");
  arguments.insert(arguments.end(), {"--shape", files.shape.string() + "=0.25", "--shape", files.shape.string()});
  const ProgramResult made = run_program(arguments);
  CAPTURE(made.output, made.errors);
  REQUIRE(made.exit_code == 0);
  CHECK(made.errors.empty());
  CHECK_THAT(made.output, Contains("55 joints") && Contains("3 expressions") && Contains("expression 1: jawOpen"));

  TrainCommand train(folder, tiny_config());
  train.body = folder / "body.npz";
  train.more = {"--iterations", "2"};
  const ProgramResult trained = train();
  CAPTURE(trained.output, trained.errors);
  CHECK(trained.exit_code == 0);
  CHECK(line_count(train.run / "history.jsonl") == 2);
}

TEST_CASE("degas body refuses what it cannot read in one line") {
  const TemporaryFolder folder;
  const TinyMakeHuman files(folder / "makehuman");
  std::vector<std::string> arguments = body_arguments(files, folder / "body.npz");
  std::string expected;
  SECTION("a weight that is none") {
    arguments.insert(arguments.end(), {"--shape", files.shape.string() + "=much"});
    expected = "'much' is no weight; write FILE=0.5";
  }
  SECTION("a rig that is no JSON") {
    std::ofstream(files.rig) << "{";
    expected = "rig.mhskel: is no JSON";
  }
  SECTION("a mesh that is not there") {
    fs::remove(files.base);
    expected = "base.obj: no such file";
  }
  const ProgramResult result = run_program(arguments);
  CAPTURE(result.output);
  CHECK(result.exit_code == 2);
  CHECK_THAT(result.errors, Contains(expected));
  CHECK(std::count(result.errors.begin(), result.errors.end(), '\n') == 1);
  CHECK(!fs::exists(folder / "body.npz"));
}
