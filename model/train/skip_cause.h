#pragma once

#include <map>
#include <span>
#include <string>

#include "host/optim/optimiser.h"
#include "model/data/loader.h"
#include "model/drive/pose.h"

namespace degas {

// What is said of a training step that was skipped, so that its cause is found.

bool is_finite(std::span<const float> values);
bool is_finite(const Pose& pose);

/// A skipped step looked at once more.
struct SkipFindings {
  bool pose_is_finite = true;            ///< the registered one
  std::string parameter;                 ///< one that is not finite; empty: all are
  std::map<std::string, double> losses;  ///< LossTerms::values
};

/// "step 12 was skipped (frame 3, cam00, cam05): the gradient of 'x' is not finite, nor is the registered pose, the
/// loss's term offset", or "..: its gradient's norm 9.1e+05 is 2.0e+06 times the largest of late, most of it of 'x';
/// the loss's largest term is scale, 4.9e+08".
std::string skip_text(const Optimiser::Counters::Skipped& skipped, const LoadRequest& views, const Capture& capture,
                      const SkipFindings& findings);

}  // namespace degas
