#pragma once

#include <string>
#include <utility>
#include <vector>

#include "host/device/device.h"

namespace degas::bench {

/// One way to do it, and its error at each stress: relative to the largest number of the reference, the larger of the
/// image's and the gradients', and of splats the worst of eight scenes. Infinite where a result is not finite; where
/// there is nothing to compare, no point.
struct StressSeries {
  std::string name;
  bool is_ours = false;
  std::vector<std::pair<double, double>> points;  ///< (stress, error)
};

/// Error against one stress, and where it stays below `promised_error`: by measurement; docs/stability.md states it.
struct StressAxis {
  std::string name, unit;        ///< what grows, and in what
  double range_low, range_high;  ///< working range of ours, in the same
  std::vector<StressSeries> series;
};
constexpr double promised_error = 1e-4;

/// All axes on a device of real type float: ours, and what others do, against the same equations in double precision.
std::vector<StressAxis> measure_stress(Device& device);

/// What does not hold: an error of ours above promised_error in the working range, or, outside of it, one above
/// promised_error and a quarter above another series' at the same stress. Empty when all does.
std::vector<std::string> broken_promises(const std::vector<StressAxis>& axes);

}  // namespace degas::bench
