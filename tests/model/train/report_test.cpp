#include "model/train/report.h"

#include <unistd.h>

#include <cmath>
#include <fstream>

#include "host/error.h"
#include "model/train/html.h"
#include "model/train/svg_chart.h"
#include "tests/support/catch.h"

using namespace degas;
namespace fs = std::filesystem;

TEST_CASE("base64 as in RFC 4648, section 10") {
  CHECK(base64("") == "");
  CHECK(base64("f") == "Zg==");
  CHECK(base64("fo") == "Zm8=");
  CHECK(base64("foo") == "Zm9v");
  CHECK(base64("foob") == "Zm9vYg==");
  CHECK(base64("fooba") == "Zm9vYmE=");
  CHECK(base64("foobar") == "Zm9vYmFy");
}

TEST_CASE("a chart leaves out what cannot be drawn and puts extremes on its borders") {
  const std::vector<ChartSeries> series = {{"loss", {{0, 1}, {5, NAN}, {10, 100}, {11, -1}}}};
  const std::string svg = svg_chart("Loss", "step", series, true);
  CHECK(svg.find("nan") == std::string::npos);
  // The plot's area spans 60..488 by 34..260: first point at its lower left, the last drawable one at its upper right.
  CHECK(svg.find("points=\"60.0,260.0 488.0,34.0 \"") != std::string::npos);
  CHECK(svg_chart("Empty", "step", {}, false).ends_with("</svg>"));
}

TEST_CASE("a report holds its pictures and figures in one file, and names what is missing") {
  const fs::path folder = fs::temp_directory_path() / ("degas_report_test_" + std::to_string(getpid()));
  fs::remove_all(folder);
  fs::create_directories(folder / "run");
  fs::create_directories(folder / "view" / "sheets");
  std::ofstream(folder / "run" / "history.jsonl")
      << "{\"step\":1,\"loss\":0.5}\n{\"step\":2,\"loss\":0.25,\"psnr\":20}\n";
  std::ofstream(folder / "run" / "config.json") << "{\"a\": \"<b>\"}";
  std::ofstream(folder / "view" / "metrics.json") << "{\"psnr\": 31.25, \"frames\": [0, 1], \"gaussians\": 48000}";
  std::ofstream(folder / "view" / "sheets" / "cam02_000000.png") << "picture";
  write_report(folder / "report.html", {folder / "run", {folder / "view"}});
  std::ifstream stream(folder / "report.html");
  const std::string html{std::istreambuf_iterator<char>(stream), {}};
  CHECK(html.find("31.25") != std::string::npos);
  CHECK(html.find("48000") != std::string::npos);
  CHECK(html.find(base64("picture")) != std::string::npos);
  CHECK(html.find("&lt;b&gt;") != std::string::npos);
  CHECK(html.find("<polyline") != std::string::npos);
  CHECK(html.find("http://") == html.find("http://www.w3.org/2000/svg"));
  CHECK_THROWS_WITH(write_report(folder / "x.html", {folder / "run", {folder / "novel"}}),
                    Catch::Contains("metrics.json"));
  CHECK_THROWS_WITH(write_report(folder / "x.html", {folder / "absent", {}}), Catch::Contains("history.jsonl"));
}
