#pragma once

#include <string>
#include <vector>

#include "host/device/device.h"

namespace degas::bench {

/// How far results are from the reference: relative to its largest number, the larger of the image's error and of every
/// gradient's. Infinite where a result is not finite.
struct StressPoint {
  double stress;
  double error;  ///< of splats the median of 32 scenes
  double worst;  ///< .. and the largest
};

/// One way to do it. Where there is nothing to compare, no point.
struct StressSeries {
  std::string name;
  bool is_ours = false;
  std::vector<StressPoint> points;
};

/// Error against one stress, and where ours stays below `promised_error`: by measurement; docs/stability.md states it.
struct StressAxis {
  std::string name, unit;        ///< what grows, and in what
  double range_low, range_high;  ///< working range of ours, in the same
  std::vector<StressSeries> series;
};
constexpr double promised_error = 1e-4;

/// A device of real type float and what its series is called.
struct StressedDevice {
  std::string name;
  Device& device;
};

/// All axes: ours on each device, then what others do, against the same equations in double precision.
std::vector<StressAxis> measure_stress(const std::vector<StressedDevice>& devices);

/// What does not hold: in the working range no scene's error is above promised_error; anywhere none is infinite, and
/// none of ours a quarter above another way's at the same stress (medians below 2e-6, some roundings, are alike).
/// Empty when all does.
std::vector<std::string> broken_promises(const std::vector<StressAxis>& axes);

}  // namespace degas::bench
