#pragma once

#include <string>
#include <utility>
#include <vector>

namespace degas {

struct ChartSeries {
  std::string name;
  std::vector<std::pair<double, double>> points;  ///< (x, y), x ascending
  bool is_limit = false;                          ///< not measured but to be kept to: grey and dashed
};

/// A line chart as one <svg> element: axes with round ticks, a legend, y on a logarithmic scale if asked (values that
/// are not positive are then left out, as are non-finite ones always).
std::string svg_chart(const std::string& title, const std::string& x_label, const std::vector<ChartSeries>& series,
                      bool logarithmic_y);

}  // namespace degas
