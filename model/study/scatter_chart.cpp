#include "model/study/scatter_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/train/html.h"

namespace degas {
namespace {

constexpr double width = 620, height = 420, left = 62, right = 16, top = 38, bottom = 46;
constexpr const char *ours_color = "#1b6ca8", *baseline_color = "#c8553d", *published_color = "#777",
                     *front_color = "#2f8f5b";

/// One axis from data to pixels.
class Axis {
 public:
  Axis(bool logarithmic, double first_pixel, double last_pixel)
      : logarithmic_(logarithmic), first_(first_pixel), last_(last_pixel) {}

  bool can_draw(double value) const { return std::isfinite(value) && (!logarithmic_ || value > 0); }
  void include(double value) {
    low_ = std::min(low_, scaled(value));
    high_ = std::max(high_, scaled(value));
  }
  /// To be called after the last include: leaves a margin.
  void settle() {
    if (!(low_ <= high_)) low_ = 0, high_ = 1;
    const double margin = std::max(0.06 * (high_ - low_), logarithmic_ ? 0.05 : 1e-9 + 0.01 * std::abs(high_));
    low_ -= margin;
    high_ += margin;
  }
  double pixel(double value) const { return first_ + (scaled(value) - low_) / (high_ - low_) * (last_ - first_); }
  /// Round values within the axis.
  std::vector<double> ticks() const {
    std::vector<double> values;
    if (logarithmic_) {
      for (const std::vector<double>& factors : {std::vector<double>{1, 2, 5},
                                                 {1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9},
                                                 {1,   1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2,   2.2, 2.5, 2.8, 3,  3.3,
                                                  3.6, 4,   4.5, 5,   5.5, 6,   6.5, 7,   7.5, 8,   8.5, 9,   9.5}}) {
        values.clear();
        for (int power = static_cast<int>(std::floor(low_)); power <= high_; ++power) {
          for (const double factor : factors) add_if_within(values, factor * std::pow(10, power));
        }
        if (values.size() >= 4) break;
      }
      return values;
    }
    const double raw = (high_ - low_) / 6, power = std::pow(10, std::floor(std::log10(raw)));
    double step = 10 * power;
    for (const double factor : {5.0, 2.0, 1.0}) {
      if (factor * power >= raw) step = factor * power;
    }
    for (double k = std::ceil(low_ / step); k * step <= high_; ++k) values.push_back(k * step);
    return values;
  }

 private:
  double scaled(double value) const { return logarithmic_ ? std::log10(value) : value; }
  void add_if_within(std::vector<double>& values, double value) const {
    if (scaled(value) >= low_ && scaled(value) <= high_) values.push_back(value);
  }

  bool logarithmic_;
  double first_, last_;
  double low_ = std::numeric_limits<double>::infinity(), high_ = -std::numeric_limits<double>::infinity();
};

struct Box {
  double x0, y0, x1, y1;
  bool overlaps(const Box& other) const { return x0 < other.x1 && other.x0 < x1 && y0 < other.y1 && other.y0 < y1; }
};

std::string attributes_of(const std::string& kind, int index) {
  return index < 0 ? fmt::format("class=\"{}\"", kind)
                   : fmt::format("class=\"{}\" data-point=\"{}\" tabindex=\"0\"", kind, index);
}

/// Ours a disc, a baseline a square, published a hollow triangle.
std::string marker(const ScatterPoint& point, double x, double y) {
  const std::string title = "<title>" + escape(point.tooltip) + "</title>";
  switch (point.kind) {
    case PointKind::Baseline:
      return fmt::format("<g {}><rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"10\" height=\"10\" fill=\"{}\"/>{}</g>",
                         attributes_of("point", point.index), x - 5, y - 5, baseline_color, title);
    case PointKind::Published:
      return fmt::format(
          "<g {}><path d=\"M{:.1f} {:.1f}l6 11h-12z\" fill=\"#fff\" stroke=\"{}\" stroke-width=\"1.5\"/>{}</g>",
          attributes_of("point", point.index), x, y - 7, published_color, title);
    case PointKind::Ours:
      break;
  }
  return fmt::format("<g {}><circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\"{}/>{}</g>",
                     attributes_of("point", point.index), x, y, point.on_front ? 6 : 4.5, ours_color,
                     point.on_front ? fmt::format(" stroke=\"{}\" stroke-width=\"2.5\"", front_color) : "", title);
}

/// Beside a point where no label and no point is; nothing where there is no room.
std::string label_at(const std::string& text, double x, double y, std::vector<Box>& taken) {
  const double length = 6.1 * static_cast<double>(text.size());
  struct Place {
    double dx, dy;
    bool to_the_left;
  };
  for (const Place place : {Place{9, 4, false}, Place{9, -9, false}, Place{9, 16, false}, Place{-9, 4, true},
                            Place{-9, -9, true}, Place{-9, 16, true}, Place{9, 28, false}, Place{9, -21, false}}) {
    const double start = place.to_the_left ? x + place.dx - length : x + place.dx, baseline = y + place.dy;
    const Box box = {start, baseline - 10, start + length, baseline + 3};
    if (box.x0 < left || box.x1 > width - 2 || box.y0 < top || box.y1 > height - bottom) continue;
    if (std::any_of(taken.begin(), taken.end(), [&](const Box& other) { return box.overlaps(other); })) continue;
    taken.push_back(box);
    return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", x + place.dx, baseline,
                       place.to_the_left ? "end" : "start", escape(text));
  }
  return "";
}

std::string grid_lines(const Axis& x, const Axis& y) {
  std::string svg;
  for (const double value : x.ticks()) {
    svg += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#e6e6e6\"/><text x=\"{0:.1f}\" "
        "y=\"{3}\" text-anchor=\"middle\">{4:.4g}</text>",
        x.pixel(value), top, height - bottom, height - bottom + 15, value);
  }
  for (const double value : y.ticks()) {
    svg += fmt::format(
        "<line x1=\"{1}\" x2=\"{2}\" y1=\"{0:.1f}\" y2=\"{0:.1f}\" stroke=\"#e6e6e6\"/><text x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5:.4g}</text>",
        y.pixel(value), left, width - right, left - 6, y.pixel(value) + 4, value);
  }
  return svg;
}

std::string polyline(const std::vector<std::pair<double, double>>& points, const Axis& x, const Axis& y) {
  std::string text;
  for (const auto& [px, py] : points) {
    if (x.can_draw(px) && y.can_draw(py)) text += fmt::format("{:.1f},{:.1f} ", x.pixel(px), y.pixel(py));
  }
  return text;
}

/// From the left border to the last point, down at each: what lies below and to the left of it is beaten.
std::string stairs(const std::vector<std::pair<double, double>>& front, const Axis& x, const Axis& y) {
  std::string path;
  for (const auto& [px, py] : front) {
    if (!x.can_draw(px) || !y.can_draw(py)) continue;
    path += path.empty() ? fmt::format("M{} {:.1f}", left, y.pixel(py)) : fmt::format("V{:.1f}", y.pixel(py));
    path += fmt::format("H{:.1f}", x.pixel(px));
  }
  if (!path.empty()) path += fmt::format("V{}", height - bottom);
  return path.empty()
             ? path
             : fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>", path, front_color);
}

std::string legend(const ScatterChart& chart) {
  std::string svg;
  double x = width - right;
  const auto add = [&](const std::string& text, const char* color, bool is_wanted) {
    if (!is_wanted) return;
    svg += fmt::format("<text x=\"{:.0f}\" y=\"32\" text-anchor=\"end\" fill=\"{}\">{}</text>", x, color, text);
    x -= 6.1 * static_cast<double>(text.size()) + 14;
  };
  const auto has = [&](PointKind kind) {
    return std::any_of(chart.points.begin(), chart.points.end(), [&](const auto& point) { return point.kind == kind; });
  };
  add("published: other hardware and data", published_color, has(PointKind::Published));
  add("baselines", baseline_color, has(PointKind::Baseline));
  add("front", front_color, !chart.front.empty());
  add("ours", ours_color, has(PointKind::Ours));
  return svg;
}

}  // namespace

std::string scatter_svg(const ScatterChart& chart) {
  Axis x(true, left, width - right);
  Axis y(chart.logarithmic_y, chart.less_is_better ? top : height - bottom,
         chart.less_is_better ? height - bottom : top);
  const auto include = [&](double px, double py) {
    if (!x.can_draw(px) || !y.can_draw(py)) return false;
    x.include(px);
    y.include(py);
    return true;
  };
  std::vector<const ScatterPoint*> points;
  for (const ScatterPoint& point : chart.points) {
    if (include(point.x, point.y)) points.push_back(&point);
  }
  for (const ScatterLine& line : chart.lines) {
    for (const auto& [px, py] : line.points) include(px, py);
  }
  x.settle();
  y.settle();

  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"system-ui,sans-serif\" font-size=\"11\"><rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>"
      "<text x=\"{2}\" y=\"16\" font-size=\"13\" font-weight=\"600\">{3}</text>",
      width, height, left, escape(chart.title));
  svg += grid_lines(x, y) + legend(chart);
  svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>", (left + width - right) / 2,
                     height - 10, escape(chart.x_label));
  svg += fmt::format("<text transform=\"translate(14 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
                     (top + height - bottom) / 2, escape(chart.y_label));
  svg += stairs(chart.front, x, y);
  for (const bool is_strong : {false, true}) {
    for (const ScatterLine& line : chart.lines) {
      if (line.is_strong != is_strong) continue;
      svg += fmt::format(
          "<g {}><polyline fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" points=\"{}\"/><title>{}</title></g>",
          attributes_of("line", line.index), is_strong ? ours_color : "#bbb", is_strong ? 2 : 1.3,
          polyline(line.points, x, y), escape(line.tooltip));
    }
  }
  std::vector<Box> taken;
  for (const ScatterPoint* point : points) {
    const double px = x.pixel(point->x), py = y.pixel(point->y);
    svg += marker(*point, px, py);
    taken.push_back({px - 6, py - 6, px + 6, py + 6});
  }
  for (const ScatterPoint* point : points) {
    if (point->is_labelled) svg += label_at(point->label, x.pixel(point->x), y.pixel(point->y), taken);
  }
  return svg + "</svg>";
}

}  // namespace degas
