#include "model/train/svg_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace degas {
namespace {

constexpr double width = 500, height = 300, left = 60, right = 12, top = 34, bottom = 40;
constexpr const char* colors[] = {"#1b6ca8", "#c8553d", "#4a8f4a", "#8a5ea8", "#b8860b", "#3a3a3a"};
constexpr const char* limit_color = "#999";

struct Extent {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void include(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  void widen_if_flat() {
    if (high > low) return;
    low -= 0.5;
    high += 0.5;
  }
};

/// 1, 2 or 5 times a power of ten, so that about `count` ticks fit.
double tick_step(const Extent& extent, int count) {
  const double raw = (extent.high - extent.low) / count;
  const double power = std::pow(10, std::floor(std::log10(raw)));
  for (double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw) return factor * power;
  }
  return 10 * power;
}

}  // namespace

std::string svg_chart(const std::string& title, const std::string& x_label, const std::vector<ChartSeries>& series,
                      bool logarithmic_y) {
  const auto drawable = [&](double y) { return std::isfinite(y) && (!logarithmic_y || y > 0); };
  const auto scaled = [&](double y) { return logarithmic_y ? std::log10(y) : y; };
  Extent x_extent, y_extent;
  for (const ChartSeries& line : series) {
    for (const auto& [x, y] : line.points) {
      if (!drawable(y)) continue;
      x_extent.include(x);
      y_extent.include(scaled(y));
    }
  }
  if (!(x_extent.low <= x_extent.high)) x_extent.include(0), y_extent.include(0);
  x_extent.widen_if_flat();
  y_extent.widen_if_flat();
  const auto to_x = [&](double x) {
    return left + (x - x_extent.low) / (x_extent.high - x_extent.low) * (width - left - right);
  };
  const auto to_y = [&](double y) {
    return height - bottom - (y - y_extent.low) / (y_extent.high - y_extent.low) * (height - top - bottom);
  };

  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"system-ui,sans-serif\" font-size=\"11\"><text x=\"{2}\" y=\"16\" font-size=\"13\" "
      "font-weight=\"600\">{3}</text>",
      width, height, left, title);
  const double x_step = tick_step(x_extent, 6), y_step = tick_step(y_extent, 5);
  for (double x = std::ceil(x_extent.low / x_step) * x_step; x <= x_extent.high + 1e-9 * x_step; x += x_step) {
    svg += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#eee\"/><text x=\"{0:.1f}\" y=\"{3}\" "
        "text-anchor=\"middle\">{4:g}</text>",
        to_x(x), top, height - bottom, height - bottom + 14, x);
  }
  for (double y = std::ceil(y_extent.low / y_step) * y_step; y <= y_extent.high + 1e-9 * y_step; y += y_step) {
    svg += fmt::format(
        "<line x1=\"{1}\" x2=\"{2}\" y1=\"{0:.1f}\" y2=\"{0:.1f}\" stroke=\"#eee\"/><text x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5:.3g}</text>",
        to_y(y), left, width - right, left - 5, to_y(y) + 4, logarithmic_y ? std::pow(10, y) : y);
  }
  svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>", (left + width - right) / 2, height - 6,
                     x_label);
  double legend_x = width - right;
  for (size_t i = series.size(); i-- > 0;) {
    const char* color = series[i].is_limit ? limit_color : colors[i % std::size(colors)];
    svg += fmt::format("<text x=\"{:.0f}\" y=\"28\" text-anchor=\"end\" font-size=\"10\" fill=\"{}\">{}</text>",
                       legend_x, color, series[i].name);
    legend_x -= 10 + 5.6 * static_cast<double>(series[i].name.size());
    svg += fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"{} points=\"", color,
                       series[i].is_limit ? " stroke-dasharray=\"5 3\"" : "");
    for (const auto& [x, y] : series[i].points) {
      if (drawable(y)) svg += fmt::format("{:.1f},{:.1f} ", to_x(x), to_y(scaled(y)));
    }
    svg += "\"/>";
  }
  return svg + "</svg>";
}

}  // namespace degas
