#include <cmath>
#include <nlohmann/json.hpp>

#include "host/io/file_bytes.h"
#include "host/io/image.h"
#include "tests/support/catch.h"
#include "tests/support/test_devices.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
namespace fs = std::filesystem;

namespace {

const fs::path stored = fs::path(DEGAS_TEST_VECTORS) / "evaluation";  // of tests/vectors/make_evaluation.py

std::vector<std::string> eval_stored(const fs::path& output) {
  return {"eval", "--pictures", stored / "render", "--truth", stored, "--out", output};
}

}  // namespace

TEST_CASE("metrics.json of a stored prediction set agrees with PyTorch and scipy") {
  const TemporaryFolder folder;
  const fs::path network = stored / "features.onnx";
  std::vector<std::string> arguments = eval_stored(folder / "out");
  arguments.insert(arguments.end(), {"--inception", network, "--inception-input", "side=40,mean=100,scale=0.02",
                                     "--expression", network, "--expression-input", "side=40,mean=100,scale=0.02"});
  const std::string weights = data_path("weights");
  if (!weights.empty()) arguments.insert(arguments.end(), {"--lpips", "alex,squeeze"});
  const ProgramResult result = run_program(arguments, {{"DEGAS_LPIPS", weights}});
  CAPTURE(result.output, result.errors);
  REQUIRE(result.exit_code == 0);
  const nlohmann::json metrics = nlohmann::json::parse(file_text(folder / "out/metrics.json"));
  const nlohmann::json expected = nlohmann::json::parse(file_text(stored / "expected.json"));
  REQUIRE(expected.size() == 21);  // five figures of four regions, and AED
  for (const auto& [key, value] : expected.items()) {
    const bool is_lpips = key.find("lpips") != std::string::npos, is_fid = key.find("fid") != std::string::npos;
    if (is_lpips && weights.empty()) continue;
    const double wanted = value.get<double>();
    const double bar = is_lpips ? 1e-4 : is_fid ? 1e-3 * wanted : key.find("psnr") != std::string::npos ? 1e-4 : 1e-5;
    CAPTURE(key, metrics.at(key), wanted);
    CHECK(std::abs(metrics.at(key).get<double>() - wanted) < bar);
  }
  CHECK(metrics.at("pictures") == 12);
  CHECK(metrics.at("cameras") == 2);
  CHECK(metrics.at("networks").at("inception").at("file") == "features.onnx");
  // The noise grows with the frame's number.
  CHECK(metrics.at("worst").at("person").at(0) == "cam01_000011");
  CHECK(read_image(folder / "out/worst.png").height == 8 * 256);
  CHECK(line_count(folder / "out/per_frame.csv") == 13);
  CHECK(read_image(folder / "out/sheets/cam00_000004.png").width == 3 * 96);
}

TEST_CASE("pictures and truths that do not fit are refused in one line") {
  const TemporaryFolder folder;
  fs::copy(stored, folder / "set", fs::copy_options::recursive);
  const auto refused = [&](const std::vector<std::string>& parts, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"eval",         "--pictures", folder / "set/render", "--truth",
                                          folder / "set", "--out",      folder / "out"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    check_refused(run_program(arguments), parts);
    CHECK_FALSE(fs::exists(folder / "out/metrics.json"));
  };
  check_refused(run_program({"eval", "--out", folder / "out"}), {"name --run and --data", "--pictures and --truth"});
  refused({"--inception-input: 'side=x' must be a number"},
          {"--inception", stored / "features.onnx", "--inception-input", "side=x"});
  refused({"--expression-input: 'sides=3'", "keys are side, mean, scale and output"},
          {"--expression", stored / "features.onnx", "--expression-input", "sides=3"});
  refused({"is no ONNX network"}, {"--inception", stored / "boxes.json"});
  write_image(folder / "set/render/cam00_000004.png", Image8::black(96, 100, 3));
  refused({"render/cam00_000004.png: 96x100 pixels", "has 96x112"});
  fs::remove(folder / "set/render/cam00_000000.png");
  refused({"render/cam00_000000.png"});
  for (const char* boxes :
       {"[]", "{", R"([{"camera":"a","frame":0,"refined":false,"person":null}])",
        R"([{"camera":"../a","frame":0,"refined":false,"person":[0,0,9,9],"face":null,"mouth":null}])",
        R"([{"camera":"a","frame":0,"refined":false,"person":[0,0,9,-9],"face":null,"mouth":null}])"}) {
    CAPTURE(boxes);
    write_text(folder / "set/boxes.json", boxes);
    refused({"boxes.json: "});
  }
  fs::remove(folder / "set/boxes.json");
  refused({"boxes.json: no such file; name the folder of an earlier `degas eval`"});
}
