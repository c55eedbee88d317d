#include "model/train/skip_cause.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace degas {

bool is_finite(std::span<const float> values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

bool is_finite(const Pose& pose) {
  return pose.translation.allFinite() &&
         std::all_of(pose.axis_angles.begin(), pose.axis_angles.end(),
                     [](const Eigen::Vector3d& axis_angle) { return axis_angle.allFinite(); });
}

std::string skip_text(const Optimiser::Counters::Skipped& skipped, const LoadRequest& views, const Capture& capture,
                      const SkipFindings& findings) {
  std::vector<std::string> cameras, not_finite;
  for (const int camera : views.cameras) cameras.push_back(capture.camera_names()[static_cast<size_t>(camera)]);
  if (!findings.pose_is_finite) not_finite.emplace_back("the registered pose");
  if (!findings.parameter.empty()) not_finite.push_back(fmt::format("the parameter '{}'", findings.parameter));
  std::pair<std::string, double> largest;
  for (const auto& [name, value] : findings.losses) {
    if (name == "loss") continue;  // their sum
    if (!std::isfinite(value)) not_finite.push_back(fmt::format("the loss's term {}", name));
    if (std::abs(value) >= std::abs(largest.second)) largest = {name, value};
  }
  const std::string step =
      fmt::format("step {} was skipped (frame {}, {}): ", skipped.step, views.frame, fmt::join(cameras, ", "));
  if (std::isfinite(skipped.norm)) {
    return step + fmt::format(
                      "its gradient's norm {:.2g} is {:.2g} times the largest of late, most of it of '{}'; the "
                      "loss's largest term is {}, {:.2g}",
                      skipped.norm, skipped.norm / skipped.largest_norm, skipped.parameter, largest.first,
                      largest.second);
  }
  return step + fmt::format("the gradient of '{}' is not finite{}{}", skipped.parameter,
                            not_finite.empty() ? "" : ", nor is ", fmt::join(not_finite, ", "));
}

}  // namespace degas
