#include "model/train/skip_cause.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace degas {

bool is_finite(std::span<const float> values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

std::vector<std::string> non_finite_inputs(const DrivingSignal& signal) {
  const bool pose = signal.pose.translation.allFinite() &&
                    std::all_of(signal.pose.axis_angles.begin(), signal.pose.axis_angles.end(),
                                [](const Eigen::Vector3d& axis_angle) { return axis_angle.allFinite(); });
  std::vector<std::string> found;
  if (!pose) found.emplace_back("the registered pose");
  if (!is_finite(signal.face_code)) found.emplace_back("the face code");
  return found;
}

std::string skip_text(const Adam::Counters& counters, const LoadRequest& views, const Capture& capture,
                      const std::vector<std::string>& not_finite) {
  const Adam::Counters::Skipped& skipped = counters.last_skipped;
  std::vector<std::string> cameras;
  for (const int camera : views.cameras) cameras.push_back(capture.camera_names()[static_cast<size_t>(camera)]);
  std::string text =
      fmt::format("step {} was skipped (frame {}, {}): ", skipped.step, views.frame, fmt::join(cameras, ", "));
  if (std::isfinite(skipped.norm)) {
    return text + fmt::format("its gradient's norm {:.2g} is {:.2g} times the usual one, most of it of '{}'",
                              skipped.norm, skipped.norm / counters.usual_norm, skipped.parameter);
  }
  return text + fmt::format("the gradient of '{}' is not finite{}{}", skipped.parameter,
                            not_finite.empty() ? "" : ", nor is ", fmt::join(not_finite, ", "));
}

}  // namespace degas
