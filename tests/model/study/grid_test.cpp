#include "model/study/grid.h"

#include <signal.h>

#include <algorithm>
#include <fstream>

#include "host/io/image.h"
#include "tests/model/study/variant_names.h"
#include "tests/support/html_check.h"
#include "tests/support/study_commands.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

Variant base_in(const TemporaryFolder& folder) {
  std::ofstream(folder / "base.json") << R"({"net": {"resolution": 256, "width": 0.5}})";
  return make_variant("base", folder / "base.json", {});
}

}  // namespace

TEST_CASE("a grid's sweeps vary each key by itself, its points several; what is there already is left out") {
  const TemporaryFolder folder;
  std::ofstream(folder / "grid.json") << R"({"sweep": {"net.resolution": [128, 256], "face.signal": ["none"]},
    "points": [{"set": {"net.width": 0.25, "net.use_pve": false}}, {"name": "fast", "set": {"net.resolution": 128,
    "net.width": 0.25}}]})";
  const std::vector<Variant> grid = grid_variants(base_in(folder), folder / "grid.json");
  CHECK(names_of(grid) ==
        std::vector<std::string>{"base", "resolution 128", "signal none", "width 0.25, use pve false", "fast"});
  CHECK(grid[1].config.net.width == 0.5);
  CHECK(grid[2].config.face.signal == FaceSignal::None);
  CHECK(grid[4].config.net.resolution == 128);
  CHECK(grid[4].overrides == std::vector<std::string>{"net.resolution=128", "net.width=0.25"});
}

TEST_CASE("the sweep without a file has at least twelve configurations that all differ") {
  const TemporaryFolder folder;
  std::ofstream(folder / "full.json") << "{}";
  for (const Variant& base : {base_in(folder), make_variant("full", folder / "full.json", {})}) {
    const std::vector<Variant> grid = default_grid(base);
    CHECK(grid.size() >= 12);
    CHECK_NOTHROW(require_distinct(grid));
    for (size_t i = 0; i < grid.size(); ++i) {
      for (size_t k = 0; k < i; ++k) CHECK_FALSE(config_differences(grid[i].config, grid[k].config).empty());
    }
  }
}

TEST_CASE("grids that cannot be read are refused with what is wrong, before anything is trained") {
  const TemporaryFolder folder;
  StudyCommand pareto(folder, "pareto", 4);
  pareto.more = {"--grid", folder / "grid.json"};
  const auto [text, parts] = GENERATE(table<std::string, std::vector<std::string>>({
      {R"({"sweep": {"net.widht": [1]}})", {"grid.json: ", "unknown key 'net.widht'", "'net.width'"}},
      {R"({"sweep": {"net.width": [0]}})", {"grid.json: ", "variant 'width 0'", "net.width"}},
      {R"({"sweep": {"net.width": 1}})", {"grid.json: sweep: 'net.width' must be a list of values"}},
      {R"({"sweep": []})", {"grid.json: 'sweep' must hold keys"}},
      {R"({"sweeps": {}})", {"grid.json: a grid must hold 'sweep' or 'points'"}},
      {R"({"sweep": {}, "point": []})", {"grid.json: unknown key 'point'"}},
      {R"({"points": [{"name": "a"}]})", {"grid.json: points[0]: needs 'set'"}},
      {R"({"points": [{"name": 3, "set": {"net.width": 1}}]})", {"grid.json: points[0]: 'name' must be a text"}},
      {R"({"points": [{"name": "a", "set": {"net.width": 1}}, {"name": "a", "set": {"net.width": 2}}]})",
       {"grid.json: variant 'a': there are two of this name"}},
      {R"({"sweep": {"train.iterations": [10, 20]}})",
       {"grid.json: 'train.iterations' is the same for every variant", "--minutes"}},
      {R"({"points": [{"set": {"train.seed": 3}}]})", {"grid.json: 'train.seed' is the same", "--seeds"}},
      {R"({"points": )", {"grid.json"}},
  }));
  std::ofstream(folder / "grid.json") << text;
  CAPTURE(text);
  check_refused(pareto(), parts);
  CHECK_FALSE(fs::exists(pareto.output));
}

TEST_CASE("pareto trains a grid and baselines, goes on where it was stopped, and draws its chart by itself") {
  const TemporaryFolder folder;
  StudyCommand pareto(folder, "pareto", 8);
  fs::create_directory(folder / "baselines");
  Config baseline = tiny_config();
  baseline.net.kind = NetKind::Static;
  std::ofstream(folder / "baselines/static.json") << config_text(baseline);
  std::ofstream(folder / "grid.json") << R"({"points": [{"name": "half", "set": {"data.image_scale": 0.5}}]})";
  pareto.more = {"--grid", folder / "grid.json",     "--baselines", folder / "baselines",
                 "--set",  "train.refine_poses=true"};
  {
    RunningProgram program(pareto.arguments());
    REQUIRE(await_lines(program, pareto.output / "half/seed1/run", 3));
    program.send(SIGKILL);
    program.wait();
  }
  const std::string first = file_text(pareto.output / "config/seed1/record.json");
  CHECK_FALSE(first.empty());
  const ProgramResult result = pareto();
  CAPTURE(result.output, result.errors);
  REQUIRE(result.exit_code == 0);
  const bool kept = file_text(pareto.output / "config/seed1/record.json") == first;
  CHECK(kept);

  const json found = json::parse(file_text(pareto.output / "pareto.json"));
  const json& points = found.at("points");
  REQUIRE(points.size() == 3);
  CHECK(points[2].at("name") == "baseline static");
  CHECK(points[2].at("baseline") == true);
  for (const json& point : points) {
    CAPTURE(point.at("name"));
    REQUIRE(point.at("times").size() == 4);
    for (size_t i = 0; i < 4; ++i) CHECK(point["times"][i].at("steps") == 1 << i);
    // The last point of the curve is the final evaluation: all six frames are among at most sixteen.
    CHECK(point["times"][3].at("curve").at("view").at("psnr").get<double>() ==
          Approx(point.at("quality").at("view").at("psnr").at("mean").get<double>()).margin(1e-5));
    CHECK(point.at("fps") > 0);
    CHECK(point.at("memory_mib") > 0);
  }
  // Measured at full size, and its refined poses are used there too.
  const json half = json::parse(file_text(pareto.output / "half/seed1/view/metrics.json"));
  CHECK(half.at("refined_pictures") == half.at("pictures"));
  CHECK(read_image(pareto.output / "half/seed1/view/render/cam02_000000.png").width == 64);
  CHECK_FALSE(fs::exists(pareto.output / "half/seed1/at_0.5/view/render"));

  const std::string html = file_text(pareto.output / "report.html");
  CHECK(html_fault(html) == "");
  CHECK_THAT(html, Contains("data:image/jpeg;base64,") && Contains("baseline static"));
  const auto draw = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"pareto", "--chart", pareto.output / "pareto.json", "--out",
                                      folder / "chart.svg"};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words);
  };
  CHECK(draw({}).exit_code == 0);
  CHECK_THAT(file_text(folder / "chart.svg"),
             Catch::StartsWith("<svg xmlns=") && Contains("PSNR, novel sequence P1C2"));
  CHECK(html_fault(file_text(folder / "chart.svg")) == "");
  check_refused(draw({"--measure", "beauty"}), {"--measure beauty: ", "psnr"});
  check_refused(draw({"--capture", "moon"}), {"--capture moon: ", "view, novel P1C2"});
  check_refused(run_program({"pareto", "--chart", folder / "grid.json", "--out", folder / "x.svg"}),
                {"grid.json: is no pareto.json"});
  check_refused(run_program({"pareto"}), {"--data is needed"});
}
