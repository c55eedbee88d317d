#pragma once

#include <span>
#include <string>
#include <vector>

#include "host/optim/adam.h"
#include "model/data/loader.h"
#include "model/drive/driving_signal.h"

namespace degas {

// What is said of a training step that was skipped, so that its cause is found.

bool is_finite(std::span<const float> values);

/// The parts of a signal that are not finite, in words.
std::vector<std::string> non_finite_inputs(const DrivingSignal& signal);

/// Of the last skipped step: "step 12 was skipped (frame 3, cam00, cam05): the gradient of 'x' is not finite, nor is
/// the registered pose", or "..: its gradient's norm 9.1e+05 is 2.0e+06 times the usual one, most of it of 'x'".
/// not_finite: what else is not, in words.
std::string skip_text(const Adam::Counters& counters, const LoadRequest& views, const Capture& capture,
                      const std::vector<std::string>& not_finite);

}  // namespace degas
