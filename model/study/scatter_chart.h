#pragma once

#include <string>
#include <utility>
#include <vector>

namespace degas {

enum class PointKind { Ours, Baseline, Published };

struct ScatterPoint {
  double x, y;
  std::string label;    ///< drawn beside it where there is room, when `is_labelled`
  std::string tooltip;  ///< shown on hover, one line each
  PointKind kind = PointKind::Ours;
  bool on_front = false, is_labelled = false;
  int index = -1;  ///< data-point of its element, for a page's script; none below 0
};

struct ScatterLine {
  std::vector<std::pair<double, double>> points;
  std::string tooltip;
  bool is_strong = false;  ///< drawn in colour, over the others
  int index = -1;
};

/// Points in a plane whose x is logarithmic, as a static <svg> element that also stands alone in a file. Up and to the
/// right is better: a y of which less is better grows downwards.
struct ScatterChart {
  std::string title, x_label, y_label;
  bool logarithmic_y = false, less_is_better = false;
  std::vector<ScatterPoint> points;
  std::vector<ScatterLine> lines;
  std::vector<std::pair<double, double>> front;  ///< (x, y) by ascending x: drawn as the stairs below which all lies
};

/// What cannot be drawn (not finite, or not positive on a logarithmic axis) is left out.
std::string scatter_svg(const ScatterChart& chart);

}  // namespace degas
