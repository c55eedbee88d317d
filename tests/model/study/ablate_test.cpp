#include <signal.h>

#include "host/io/checkpoint.h"
#include "host/io/npz.h"
#include "tests/support/study_commands.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

constexpr int steps = 16;

/// Four cameras train: "4 (all)" and "3".
StudyCommand views_study(const TemporaryFolder& folder) {
  StudyCommand ablate(folder, "ablate", steps);
  ablate.more = {"--study", "views"};
  return ablate;
}

void check_finished(const ProgramResult& result) {
  CAPTURE(result.output, result.errors, result.ended_by);
  CHECK(result.exit_code == 0);
}

}  // namespace

TEST_CASE("a study killed in the middle goes on to the figures of one that was not, and is then finished") {
  const TemporaryFolder whole_folder, folder;
  const StudyCommand whole = views_study(whole_folder);
  StudyCommand ablate = views_study(folder);
  check_finished(whole());
  const fs::path first = ablate.output / "4-all-/seed1", second = ablate.output / "3/seed1";
  {
    RunningProgram program(ablate.arguments());
    REQUIRE(await_lines(program, first / "run", 6));
    program.send(SIGKILL);
    CHECK(program.wait().ended_by == SIGKILL);
    CHECK_FALSE(fs::exists(first / "record.json"));
  }
  {
    RunningProgram program(ablate.arguments());
    REQUIRE(await_lines(program, second / "run", 6));
    program.send(SIGINT);
    const ProgramResult result = program.wait();
    check_finished(result);
    CHECK_THAT(result.output, Contains("interrupted; the same command goes on") && Contains("4 (all)"));
    CHECK(json::parse(file_text(ablate.output / "ablation.json")).at("variants").size() == 1);
  }
  check_finished(ablate());
  for (const char* run : {"4-all-/seed1/run", "3/seed1/run"}) {
    check_history(ablate.output / run, steps);
    const bool same =
        file_text(ablate.output / run / "checkpoint.bin") == file_text(whole.output / run / "checkpoint.bin");
    CHECK(same);
  }
  const json ablation = json::parse(file_text(ablate.output / "ablation.json"));
  const json& variants = ablation.at("variants");
  REQUIRE(variants.size() == 2);
  CHECK(ablation.at("measured_on") == json::array({"view", "novel P1C2"}));
  CHECK(variants[1].at("name") == "3");
  CHECK(variants[1].at("paper")[0].at("figures").at("psnr") == 29.66);
  const json& run = variants[1].at("runs")[0];
  for (const char* key : {"command", "commit", "budget", "config", "memory_mib"}) CHECK(run.contains(key));
  for (const char* key : {"device", "driver", "minutes", "steps", "parameters", "gaussians", "memory_mib"})
    CHECK(run.at("training").contains(key));
  CHECK(run.at("training").at("steps") == steps);
  CHECK(run.at("training").at("minutes") > 0);
  // The differences are those of the metrics, whose means they are.
  const auto psnr = [&](size_t i) {
    return variants[i].at("runs")[0].at("evaluations").at("view").at("metrics").at("psnr").get<double>();
  };
  CHECK(variants[1].at("evaluations").at("view").at("difference").at("psnr").at("mean").get<double>() ==
        Approx(psnr(1) - psnr(0)).margin(1e-5));
  CHECK(variants[0].at("evaluations").at("view").at("difference").at("psnr").at("mean") == 0);
  CHECK_THAT(file_text(ablate.output / "ablation.md"), Contains("| 4 (all)") && Contains("3 PSNR 29.66"));

  // Once more: nothing is run again.
  const std::string record = file_text(second / "record.json");
  const auto written = fs::last_write_time(second / "record.json");
  const ProgramResult again = ablate();
  check_finished(again);
  CHECK_THAT(again.output, Contains("3 PSNR 29.66") && !Contains("step "));
  const bool same =
      file_text(second / "record.json") == record && fs::last_write_time(second / "record.json") == written;
  CHECK(same);

  // Another plan into the same folder is refused.
  ablate.more.insert(ablate.more.end(), {"--iterations", "17"});
  check_refused(ablate(), {"seed1: was made by another plan: ", "train.iterations (16 / 17)", "--out"});
  ablate.more = {"--study", "views", "--minutes", "1"};
  check_refused(ablate(), {"seed1: was made by another plan: minutes (null / 1.0)"});
  ablate.more = {"--study", "views", "--tune", "fast"};
  check_refused(ablate(), {"seed1: was made by another plan: tune (null / \"fast\")"});
}

TEST_CASE("a variant interrupted under a budget in minutes goes on with its remaining minutes") {
  const TemporaryFolder folder;
  StudyCommand ablate(folder, "ablate", steps);
  constexpr double minutes = 0.1;
  ablate.more = {"--study", "views", "--minutes", "0.1"};
  const fs::path run = ablate.output / "4-all-/seed1/run";
  const auto minutes_spent = [&] {
    return read_checkpoint(run / "checkpoint.bin").header.at("minutes_spent").get<double>();
  };
  std::string history;
  {
    RunningProgram program(ablate.arguments());
    REQUIRE(await_lines(program, run, 4));
    program.send(SIGINT);
    check_finished(program.wait());
    CHECK(minutes_spent() > 0);
    CHECK(minutes_spent() < minutes);
    history = file_text(run / "history.jsonl");
  }
  RunningProgram program(ablate.arguments());
  while (!fs::exists(run / "../record.json") && program.running())
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  program.send(SIGINT);
  check_finished(program.wait());
  const json record = json::parse(file_text(run / "../record.json"));
  const double spent = record.at("training").at("minutes").get<double>();
  CHECK(spent >= minutes);
  CHECK(spent == Approx(minutes_spent()).margin(1e-9));
  // Not begun anew, and no more than a step beyond the budget.
  CHECK_THAT(file_text(run / "history.jsonl"), Catch::StartsWith(history));
  CHECK(spent < minutes + 0.05);
  CHECK_THAT(record.at("command").get<std::string>(), Contains("--minutes 0.1"));
}

TEST_CASE("a stability study tells the worst of its seeds, and its evaluations are repeated by degas eval") {
  const TemporaryFolder folder;
  StudyCommand ablate(folder, "ablate", 3);
  ablate.more = {"--study", "stability", "--only", "registration off by up to 3 degrees and 1 cm",
                 "--seeds", "3",         "--set",  "train.refine_poses=true"};
  check_finished(ablate());
  const json ablation = json::parse(file_text(ablate.output / "ablation.json"));
  REQUIRE(ablation.at("variants").size() == 2);
  const json& variant = ablation.at("variants")[1];
  const json& spread = variant.at("evaluations").at("view").at("spread").at("psnr");
  CHECK(spread.at("count") == 3);
  CHECK(spread.at("lowest") < spread.at("median"));
  CHECK(spread.at("median") < spread.at("highest"));
  CHECK(variant.at("runs")[0].at("training").at("skipped_steps") == 0);
  CHECK_THAT(file_text(ablate.output / "ablation.md"), Contains("PSNR, worst seed minus median | steps skipped"));

  // Another choice of variants would take the first one's row from the table.
  StudyCommand other = ablate;
  other.more[3] = "20 % of masks wrong";
  check_refused(other(), {"its table has 'registration off by up to 3 degrees and 1 cm', which would be lost"});

  // The registration that training saw, on the recording that it saw; never a wrong mask in what is measured.
  const fs::path run = ablate.output / "registration-off-by-up-to-3-degrees-and-1-cm/seed2/run",
                 scene = training_scene();
  check_finished(run_program({"eval", "--run", run, "--data", scene / "P1C1", "--cameras", "cam02", "--out",
                              folder / "again", "--cache", scene / "cache"}));
  CHECK(json::parse(file_text(folder / "again/metrics.json")).at("psnr") ==
        variant.at("runs")[1].at("evaluations").at("view").at("metrics").at("psnr"));
  CHECK(variant.at("runs")[1].at("evaluations").at("view").at("metrics").at("refined_pictures") > 0);
}

TEST_CASE("studies that cannot be made are refused before anything is written") {
  const TemporaryFolder folder;
  StudyCommand ablate = views_study(folder);
  SECTION("no such study") {
    ablate.more = {"--study", "hats"};
    const ProgramResult result = ablate();
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.errors, Contains("--study") && Contains("hats") && Contains("encoders"));
  }
  SECTION("no such camera") {
    ablate.more.insert(ablate.more.end(), {"--set", "data.cameras=cam77"});
    check_refused(ablate(), {"no camera 'cam77'"});
  }
  SECTION("nothing held out") {
    StudyCommand none = ablate;
    auto words = none.arguments();
    words.erase(std::find(words.begin(), words.end(), "--hold-out"), std::find(words.begin(), words.end(), "--cache"));
    check_refused(run_program(words), {"--hold-out: no camera is held out"});
  }
  SECTION("a novel sequence that is none") {
    ablate.more.insert(ablate.more.end(), {"--novel", folder / "none"});
    check_refused(ablate(), {"none: no such folder"});
  }
  SECTION("two budgets") {
    ablate.more.insert(ablate.more.end(), {"--minutes", "1", "--iterations", "5"});
    const ProgramResult result = ablate();
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.errors, Contains("--iterations") && Contains("--minutes"));
  }
  CHECK_FALSE(fs::exists(ablate.output));
}

TEST_CASE("a variant that cannot be trained is told of, and the others go on") {
  const TemporaryFolder folder;
  StudyCommand ablate(folder, "ablate", 2);
  ablate.more = {"--study", "losses",
                 "--set",   "loss.ssim_weight=0",
                 "--set",   "loss.offset_weight=0",
                 "--set",   "loss.scale_weight=0",
                 "--set",   "loss.collapse_weight=0",
                 "--set",   "loss.lpips_weights=/none.npz"};
  const ProgramResult result = ablate();
  CAPTURE(result.output, result.errors);
  CHECK(result.exit_code == 2);
  CHECK_THAT(result.errors, Contains("1 of 2 runs could not be made: with LPIPS: LPIPS weights: /none.npz"));
  CHECK_THAT(result.output, Contains("| all terms"));
  CHECK_THAT(file_text(ablate.output / "ablation.md"), Contains("Not trained: with LPIPS"));
}

TEST_CASE("novel sequences are measured with fitted poses too, by what commands repeat") {
  const TemporaryFolder folder;
  StudyCommand ablate(folder, "ablate", 12);
  ablate.more = {"--study", "views", "--only", "4 (all)", "--fit-poses"};
  check_finished(ablate());
  const json ablation = json::parse(file_text(ablate.output / "ablation.json"));
  CHECK(ablation.at("measured_on") == json::array({"view", "novel P1C2", "novel P1C2, poses fitted"}));
  const json& evaluations = ablation.at("variants")[0].at("runs")[0].at("evaluations");
  const json &as_registered = evaluations.at("novel P1C2"), &fitted = evaluations.at("novel P1C2, poses fitted");
  CHECK(fitted.at("metrics").at("psnr") != as_registered.at("metrics").at("psnr"));
  const auto poses = ablate.output / "4-all-/seed1/novel-P1C2-poses-fitted.npz";
  CHECK_THAT(fitted.at("command").get<std::string>(), Contains("degas fit-poses --run ") &&
                                                          Contains(" && degas eval ") &&
                                                          Contains("--poses " + poses.string()));
  CHECK(json::parse(NpzFile(poses).read("fit").text()).at("cameras") ==
        json::array({"cam00", "cam01", "cam03", "cam04"}));
  CHECK_THAT(file_text(ablate.output / "ablation.md"), Contains("novel P1C2, poses fitted"));

  // Where no held-out camera is left, poses would be fitted to what is measured.
  const auto novel = folder / "novel.pack";
  check_finished(
      run_program({"pack", "--data", training_scene() / "P1C2", "--cameras", "cam00:cam02", "--out", novel}));
  ablate.output = folder / "other";
  ablate.more.insert(ablate.more.end(), {"--novel", novel});
  check_refused(ablate(), {"--fit-poses: ", "novel.pack has none of the held-out cameras", "hold out a camera"});
}
