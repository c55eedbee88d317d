#include "model/study/pareto.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "model/study/pareto_charts.h"
#include "model/study/pareto_report.h"
#include "model/study/published.h"
#include "tests/support/catch.h"
#include "tests/support/html_check.h"

using namespace degas;
using namespace degas::test;
using nlohmann::json;

namespace {

/// The definition: every pair of points is compared.
std::vector<size_t> brute_force_front(const std::vector<FrontPoint>& points) {
  std::vector<size_t> front;
  for (size_t i = 0; i < points.size(); ++i) {
    bool is_beaten = !std::isfinite(points[i].speed) || !std::isfinite(points[i].quality);
    for (const FrontPoint& other : points) {
      const bool as_good = other.speed >= points[i].speed && other.quality >= points[i].quality;
      const bool better = other.speed > points[i].speed || other.quality > points[i].quality;
      is_beaten = is_beaten || (as_good && better && std::isfinite(other.speed) && std::isfinite(other.quality));
    }
    if (!is_beaten) front.push_back(i);
  }
  return front;
}

json point(const std::string& name, double fps, double psnr, double lpips, bool is_baseline = false) {
  json point = {{"name", name},
                {"baseline", is_baseline},
                {"config_file", "a.json"},
                {"overrides", {"net.width=1"}},
                {"differences", {}},
                {"seeds", 1},
                {"command", "degas train"},
                {"commit", "abc"},
                {"device", "a <CPU>"},
                {"driver", "1 & 2"},
                {"fps", fps},
                {"decode_ms", 500 / fps},
                {"render_ms", 500 / fps},
                {"gaussians", 1000},
                {"parameters", 2000},
                {"memory_mib", 10},
                {"training_memory_mib", 20},
                {"steps", 5},
                {"minutes", 2},
                {"folders", {{"view", "none"}}}};
  point["quality"]["view"] = {{"psnr", {{"mean", psnr}, {"count", 1}}}, {"lpips", {{"mean", lpips}, {"count", 1}}}};
  for (const double minutes : {1, 2})
    point["times"].push_back(
        {{"minutes", minutes}, {"steps", 5}, {"curve", {{"view", {{"psnr", psnr - 2 + minutes}}}}}});
  return point;
}

json three_points() {
  json pareto = {{"data", "P1C1"},
                 {"hold_out", {"cam02"}},
                 {"budget", "2 minutes"},
                 {"seeds", 1},
                 {"failures", json::array({"huge: out of memory"})},
                 {"measured_on", {"view"}}};
  pareto["points"] = {point("slow & good", 20, 32, 0.01), point("fast <1>", 60, 30, 0.02),
                      point("baseline \"x\"", 30, 29, 0.005, true)};
  pareto["fronts"]["view"] = {{"psnr", {0, 1}}, {"lpips", {2, 1}}};
  pareto["published"] = {
      {{"name", "DEGAS"}, {"fps", 30}, {"quality", {{"psnr", 31.0}}}, {"data", "d"}, {"hardware", "h"}}};
  return pareto;
}

size_t count_of(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++count;
  return count;
}

}  // namespace

TEST_CASE("the front is what no other point beats, as found by comparing every pair") {
  std::mt19937 random(7);
  for (int trial = 0; trial < 300; ++trial) {
    // Few values, so that many are equal in one or both; now and then one that is not finite.
    std::uniform_int_distribution<int> value(0, trial % 2 ? 5 : 1000), size(0, 25);
    std::vector<FrontPoint> points(static_cast<size_t>(size(random)));
    for (FrontPoint& point : points) {
      point = {static_cast<double>(value(random)), static_cast<double>(value(random))};
      if (value(random) == 3) point.quality = NAN;
      if (value(random) == 4) point.speed = INFINITY;
    }
    std::vector<size_t> front = pareto_front(points);
    for (size_t i = 1; i < front.size(); ++i) CHECK(points[front[i - 1]].speed <= points[front[i]].speed);
    std::sort(front.begin(), front.end());
    CHECK(front == brute_force_front(points));
  }
}

TEST_CASE("the choice at a speed is the best of those that reach it") {
  const std::vector<Choice> rows = choices(three_points(), "view", "psnr");
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].point == 0);
  CHECK(rows[0].faster_than == 0);
  CHECK(rows[0].up_to == 20);
  CHECK(rows[1].point == 1);
  CHECK(rows[1].faster_than == 20);
  CHECK(choices(three_points(), "view", "fid").empty());
}

TEST_CASE("the report is well-formed, needs no other file and says which one to take") {
  const std::string html = pareto_report(three_points(), "/nowhere");
  CHECK(html_fault(html) == "");
  CHECK_THAT(html, Catch::Contains("For 30 frames/s on this device, by PSNR (held-out camera): <b>fast &lt;1&gt;</b>"));
  CHECK_THAT(html, Catch::Contains("by LPIPS (held-out camera): <b>baseline &quot;x&quot;</b>"));
  CHECK_THAT(html, Catch::Contains("Baselines on a front: baseline &quot;x&quot; (LPIPS, held-out camera)"));
  CHECK_THAT(html, Catch::Contains("<td>PSNR, held-out camera</td><td>slow &amp; good</td><td>32.00</td><td>baseline "
                                   "&quot;x&quot;</td><td>29.00</td><td>+3.00</td>"));
  CHECK_THAT(html, Catch::Contains("<td>0.0100</td><td>baseline &quot;x&quot;</td><td>0.0050</td><td>+100 %</td>"));
  CHECK_THAT(html, Catch::Contains("the next better, slow &amp; good (+2.00), makes only"));
  CHECK_THAT(html, Catch::Contains("huge: out of memory"));
  // A line for every configuration and the heading; the published point is in the chart of PSNR alone.
  const std::string figures = html.substr(html.find("class=\"figures\""));
  CHECK(count_of(figures.substr(0, figures.find("</table>")), "<tr>") == 4);
  CHECK(count_of(html, "<path d=\"M") - count_of(html, "fill=\"none\" stroke=\"#2f8f5b\"") == 1);
  json nothing = three_points();
  nothing["points"] = json::array();
  CHECK(html_fault(pareto_report(nothing, "/nowhere")) == "");
  // The checker itself sees what it is for.
  CHECK(html_fault("<p><b></p></b>") != "");
  CHECK(html_fault("<p>") != "");
  CHECK(html_fault("<img src=\"https://x\">") != "");
  CHECK(html_fault("<p a=\"b\"c\"></p>") != "");
  CHECK(html_fault("<p>1 < 2</p>") != "");
}

TEST_CASE("a chart places points by logarithms, better ones higher") {
  ScatterChart chart;
  chart.less_is_better = chart.logarithmic_y = true;
  chart.points = {
      {10, 0.1, "a", "a"}, {100, 0.01, "b", "b"}, {1000, 0.001, "c", "c"}, {50, 0, "d", "d"}, {NAN, 1, "e", "e"}};
  const std::string svg = scatter_svg(chart);
  CHECK(html_fault(svg) == "");
  std::vector<double> x, y;
  for (size_t at = 0; (at = svg.find("<circle cx=\"", at)) != std::string::npos; ++at) {
    x.push_back(std::stod(svg.substr(at + 12)));
    y.push_back(std::stod(svg.substr(svg.find("cy=\"", at) + 4)));
  }
  REQUIRE(x.size() == 3);
  CHECK(x[1] - x[0] == Approx(x[2] - x[1]).margin(0.11));
  CHECK(y[1] - y[0] == Approx(y[2] - y[1]).margin(0.11));
  CHECK(x[1] > x[0]);
  CHECK(y[1] < y[0]);
  CHECK(scatter_svg({}).ends_with("</svg>"));
}

TEST_CASE("speed charts hold every point, and the published ones that have the measure") {
  const ScatterChart psnr = speed_chart(three_points(), "view", "psnr"),
                     lpips = speed_chart(three_points(), "view", "lpips");
  CHECK(psnr.points.size() == 4);
  CHECK(psnr.points[3].kind == PointKind::Published);
  CHECK(psnr.front == std::vector<std::pair<double, double>>{{20, 32}, {60, 30}});
  CHECK_FALSE(psnr.less_is_better);
  CHECK(lpips.points.size() == 3);
  CHECK(lpips.points[2].kind == PointKind::Baseline);
  CHECK(lpips.logarithmic_y);
  const ScatterChart training = training_chart(three_points(), "view", "psnr");
  REQUIRE(training.lines.size() == 3);
  CHECK(training.lines[0].points == std::vector<std::pair<double, double>>{{1, 31}, {2, 32}});
  CHECK(training.lines[1].is_strong);
  CHECK_FALSE(training.lines[2].is_strong);
}
