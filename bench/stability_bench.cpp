// How far results are from the same equations in double precision, against what strains them: ours, and what widely
// used splatters do. A table; with --json FILE, --svg FILE and --html FILE the charts and their numbers.
// With --check, which tries both kernel sets on a CPU, the exit code is 1 where what docs/stability.md says does not
// hold.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>

#include "bench/stability/stress.h"
#include "host/error.h"
#include "host/io/file_bytes.h"
#include "model/train/html.h"
#include "model/train/svg_chart.h"

using namespace degas;
using namespace degas::bench;

namespace {

struct Options {
  std::string device, json, svg, html;
  bool check = false;
};

Options parse(int count, char** values) {
  Options options;
  for (int i = 1; i < count; ++i) {
    const std::string key = values[i];
    std::string* target = key == "--device" ? &options.device
                          : key == "--json" ? &options.json
                          : key == "--svg"  ? &options.svg
                          : key == "--html" ? &options.html
                                            : nullptr;
    if (key == "--check") {
      options.check = true;
    } else if (target && i + 1 < count) {
      *target = values[++i];
    } else {
      fmt::print("usage: {} [--device INDEX|NAME] [--json FILE] [--svg FILE] [--html FILE] [--check]\n", values[0]);
      std::exit(key == "--help" ? 0 : 2);
    }
  }
  return options;
}

/// Without points of no error, which a logarithm does not show; infinite ones are drawn at the top. What is promised is
/// a line over the working range.
std::string chart_of(const StressAxis& axis) {
  constexpr double most = 1e2;
  std::vector<ChartSeries> series;
  for (const StressSeries& from : axis.series) {
    ChartSeries line{from.name, {}};
    for (const StressPoint& at : from.points) line.points.emplace_back(at.stress, std::min(at.error, most));
    series.push_back(line);
  }
  series.push_back({"promised", {{axis.range_low, promised_error}, {axis.range_high, promised_error}}, true});
  return svg_chart(axis.name, axis.unit, series, true);
}

/// The charts below one another, as one picture that stands alone.
std::string sheet_of(const std::vector<StressAxis>& axes) {
  constexpr int width = 500, height = 300, columns = 2;
  const int rows = (static_cast<int>(axes.size()) + columns - 1) / columns;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\">"
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>",
      columns * width, rows * height);
  for (size_t i = 0; i < axes.size(); ++i) {
    svg += fmt::format("<g transform=\"translate({} {})\">{}</g>", static_cast<int>(i) % columns * width,
                       static_cast<int>(i) / columns * height, chart_of(axes[i]));
  }
  return svg + "</svg>\n";
}

std::string page_of(const std::vector<StressAxis>& axes, const std::string& device) {
  std::string html = page_head("Error against stress");
  html += fmt::format(
      "<p>On {}. Error: the largest difference from the same equations in double precision, of the image or of any "
      "gradient, relative to the largest number there; the median of many scenes. Promised of every scene within the "
      "working range: {:g}.</p>",
      escape(device), promised_error);
  for (const StressAxis& axis : axes) {
    html += chart_of(axis) +
            fmt::format("<p>Working range: {:g} to {:g} {}.</p>", axis.range_low, axis.range_high, escape(axis.unit));
  }
  return html + "</body></html>\n";
}

nlohmann::json json_of(const std::vector<StressAxis>& axes, const std::string& device) {
  nlohmann::json all = {
      {"device", device}, {"promised_error", promised_error}, {"points", {"stress", "median error", "largest error"}}};
  const auto number = [](double error) {
    return std::isfinite(error) ? nlohmann::json(error) : nlohmann::json("not finite");
  };
  for (const StressAxis& axis : axes) {
    nlohmann::json one = {
        {"name", axis.name}, {"unit", axis.unit}, {"working_range", {axis.range_low, axis.range_high}}};
    for (const StressSeries& series : axis.series) {
      nlohmann::json points = nlohmann::json::array();
      for (const StressPoint& at : series.points) points.push_back({at.stress, number(at.error), number(at.worst)});
      one["series"].push_back({{"name", series.name}, {"points", points}});
    }
    all["axes"].push_back(one);
  }
  return all;
}

void print(const std::vector<StressAxis>& axes) {
  for (const StressAxis& axis : axes) {
    fmt::print("{} ({}), working range {:g} to {:g}\n", axis.name, axis.unit, axis.range_low, axis.range_high);
    for (const StressSeries& series : axis.series) fmt::print("  {:>36}", series.name);
    fmt::print("\n");
    for (size_t i = 0; i < axis.series[0].points.size(); ++i) {
      fmt::print("{:>10.4g}", axis.series[0].points[i].stress);
      for (const StressSeries& series : axis.series)
        fmt::print("  {:>36}", fmt::format("{:.1e} ({:.1e})", series.points[i].error, series.points[i].worst));
      fmt::print("\n");
    }
  }
}

}  // namespace

int main(int count, char** values) try {
  const Options options = parse(count, values);
  DeviceOptions device_options;
  device_options.selector = options.device;
  Device device(device_options);
  std::vector<StressedDevice> devices = {{"degas", device}};
  std::optional<Device> other;
  if (options.check && device.is_wide()) {
    device_options.kernel_set = KernelSet::Gpu;
    devices.push_back({"degas, GPU set", other.emplace(device_options)});
  }
  const std::vector<StressAxis> axes = measure_stress(devices);
  print(axes);
  const std::string name = device.description().name;
  if (!options.json.empty()) write_text(options.json, json_of(axes, name).dump(1) + "\n");
  if (!options.svg.empty()) write_text(options.svg, sheet_of(axes));
  if (!options.html.empty()) write_text(options.html, page_of(axes, name));
  const std::vector<std::string> broken = broken_promises(axes);
  for (const std::string& line : broken) fmt::print("BROKEN: {}\n", line);
  return options.check && !broken.empty() ? 1 : 0;
} catch (const Error& error) {
  fmt::print(stderr, "error: {}\n", error.what());
  return 2;
}
