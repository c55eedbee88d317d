#include "model/train/evaluator.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "host/error.h"
#include "model/data/synthetic_capture.h"
#include "model/train/picture.h"
#include "tests/support/catch.h"
#include "tests/support/training_scene.h"
#include "tests/support/training_steps.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

/// A capture whose heads are large enough for the face's figures, and a run with refined poses on it.
struct EvaluatedRun {
  TemporaryFolder folder;
  std::unique_ptr<Capture> capture, novel;
  std::unique_ptr<TrainedAvatar> avatar;

  EvaluatedRun() {
    SyntheticOptions options;
    options.frames = 2;
    options.novel_frames = 1;
    options.views = 3;
    options.width = 160;
    options.height = 208;
    write_synthetic_capture(folder / "capture", options);
    CaptureOptions opening;
    opening.cache = folder / "cache";
    capture = open_capture(folder / "capture/P1C1", opening);
    novel = open_capture(folder / "capture/P1C2", opening);
    Config config = tiny_config();
    config.train.iterations = 10;
    config.train.refine_poses = true;
    config.data.hold_out = {"cam02"};
    config.loss.lpips_weights = data_path("weights");
    avatar = std::make_unique<TrainedAvatar>(wide(), train_run(folder / "run", config, *capture));
  }
};

EvaluatedRun& evaluated_run() {
  static EvaluatedRun once;
  return once;
}

EvaluationOptions options_for(std::vector<int> cameras, std::vector<int> frames, const fs::path& output) {
  EvaluationOptions options;
  options.cameras = std::move(cameras);
  options.frames = std::move(frames);
  options.output = output;
  return options;
}

void ignore_progress(int, int) {}

/// Over all channels of an 8-bit picture.
double psnr_of_files(const fs::path& a, const fs::path& b) {
  const Image8 first = read_image(a), second = read_image(b);
  REQUIRE(first.pixels.size() == second.pixels.size());
  double total = 0;
  for (size_t i = 0; i < first.pixels.size(); ++i) {
    const double difference = (first.pixels[i] - second.pixels[i]) / 255.0;
    total += difference * difference / static_cast<double>(first.pixels.size());
  }
  return -10 * std::log10(total);
}

std::set<std::string> names_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

}  // namespace

TEST_CASE("an evaluation writes its figures and the pictures they can be made from again") {
  const fs::path out = evaluated_run().folder / "evaluation";
  int calls = 0;
  const EvaluationSummary summary = evaluate(wide(), *evaluated_run().avatar, *evaluated_run().capture,
                                             options_for({1, 2}, {0, 1}, out), [&](int done, int total) {
                                               CHECK(done == ++calls);
                                               CHECK(total == 4);
                                             });
  CHECK(calls == 4);
  CHECK(summary.pictures == 4);
  CHECK(summary.refined_pictures == 4);
  CHECK(summary.without_picture == 0);
  CHECK(summary.without_face == 0);
  const nlohmann::json metrics = nlohmann::json::parse(file_text(out / "metrics.json"));
  CHECK(metrics == summary.metrics);
  for (const char* key :
       {"psnr", "ssim", "lpips", "face_psnr", "face_ssim", "face_lpips", "mouth_psnr", "mouth_ssim", "mouth_lpips",
        "frames", "cameras", "gaussians", "parameters", "decode_ms", "render_ms", "fps"}) {
    CAPTURE(key);
    REQUIRE(metrics.contains(key));
    const bool measured = std::string(key).find("lpips") == std::string::npos ||
                          !evaluated_run().avatar->config().loss.lpips_weights.empty();
    CHECK(metrics[key].is_number() == measured);
  }
  CHECK(metrics["frames"] == 2);
  CHECK(metrics["cameras"] == 2);
  CHECK(metrics["refined_pictures"] == 4);
  CHECK(metrics["gaussians"] == evaluated_run().avatar->avatar().gaussian_count());
  CHECK(metrics["fps"].get<double>() ==
        Approx(1000 / (metrics["decode_ms"].get<double>() + metrics["render_ms"].get<double>())));

  const std::set<std::string> names = {"cam01_000000.png", "cam01_000001.png", "cam02_000000.png", "cam02_000001.png"};
  double total = 0;
  for (const char* folder : {"truth", "render", "sheets"}) CHECK(names_in(out / folder) == names);
  for (const std::string& name : names) total += psnr_of_files(out / "truth" / name, out / "render" / name) / 4;
  CHECK(metrics["psnr"].get<double>() == Approx(total).epsilon(1e-5));
  const Image8 truth = over_background(evaluated_run().capture->load(1, 2), {255, 255, 255});
  const bool same_truth = read_image(out / "truth/cam02_000001.png").pixels == truth.pixels;
  CHECK(same_truth);
  CHECK(read_image(out / "sheets/cam02_000001.png").width == 3 * truth.width);

  std::istringstream csv(file_text(out / "per_frame.csv"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(csv, line);) lines.push_back(line);
  REQUIRE(lines.size() == 5);
  CHECK(lines[0].rfind("camera,frame,refined,psnr,", 0) == 0);
  CHECK(lines[1].rfind("cam01,0,1,", 0) == 0);
  for (const std::string& line : lines) CHECK(std::count(line.begin(), line.end(), ',') == 14);

  // Scored as given pictures, its own renders have the same figures to the bit.
  EvaluationOptions options = options_for({}, {}, evaluated_run().folder / "again");
  options.networks = default_metric_networks(evaluated_run().avatar->config().loss);
  const EvaluationSummary again =
      evaluate_pictures(wide(), out / "render", EvaluationFolder(out), options, ignore_progress);
  for (const auto& [key, value] : again.metrics.items()) {
    CAPTURE(key);
    CHECK(value == metrics.at(key));
  }
  CHECK(file_text(evaluated_run().folder / "again/per_frame.csv") == file_text(out / "per_frame.csv"));
  CHECK(file_text(evaluated_run().folder / "again/worst.png") == file_text(out / "worst.png"));
}

TEST_CASE("a novel sequence is never drawn with refined poses") {
  const fs::path out = evaluated_run().folder / "novel";
  const EvaluationSummary summary =
      evaluate(wide(), *evaluated_run().avatar, *evaluated_run().novel, options_for({1}, {0}, out), ignore_progress);
  CHECK(summary.pictures == 1);
  CHECK(summary.refined_pictures == 0);
  CHECK(summary.metrics["refined_pictures"] == 0);
  CHECK_THAT(file_text(out / "per_frame.csv"), Contains("cam01,0,0,"));
}

TEST_CASE("frames without a picture are counted; none at all, or Ctrl-C, is an Error without metrics.json") {
  ChangedCapture capture;
  Config config = tiny_config();
  config.train.iterations = 1;
  const TemporaryFolder folder;
  TrainedAvatar avatar(wide(), train_run(folder / "run", config, capture));
  capture.lacks_image = [](int frame, int) { return frame == 1; };
  const fs::path out = folder / "evaluation";
  SECTION("some") {
    const EvaluationSummary summary = evaluate(wide(), avatar, capture, options_for({2}, {0, 1}, out), ignore_progress);
    CHECK(summary.pictures == 1);
    CHECK(summary.without_picture == 1);
    CHECK(summary.without_face == 1);  // of 10 pixels: too small for SSIM
    CHECK(summary.metrics["face_psnr"].is_null());
    CHECK(summary.metrics["frames"] == 1);
    CHECK(summary.refined_pictures == 0);
  }
  SECTION("none") {
    CHECK_THROWS_WITH(evaluate(wide(), avatar, capture, options_for({2}, {1}, out), ignore_progress),
                      Contains("none of the chosen frames and cameras has a picture"));
    CHECK_FALSE(fs::exists(out / "metrics.json"));
  }
  SECTION("interrupted") {
    EvaluationOptions options = options_for({2}, {0, 2}, out);
    options.stop_requested = [&] { return fs::exists(out / "render/cam02_000000.png"); };
    CHECK_THROWS_WITH(evaluate(wide(), avatar, capture, options, ignore_progress), Contains("interrupted"));
    CHECK_FALSE(fs::exists(out / "metrics.json"));
    CHECK(fs::exists(out / "truth/cam02_000000.png"));
  }
}
