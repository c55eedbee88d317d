#pragma once

#include <cstdint>
#include <vector>

#include "model/data/loader.h"

namespace degas {

/// Which frame and cameras each step takes: a function of seed and step alone. An epoch visits every frame once, in an
/// order of its own; a frame's cameras are dealt from a deck shuffled anew whenever it runs out, so that all of its
/// views are seen equally often.
class ViewSchedule {
 public:
  /// views_of_frame[i]: frame number and its usable cameras; frames without cameras are left out by the caller.
  ViewSchedule(std::vector<LoadRequest> views_of_frame, int views_per_step, uint64_t seed);

  LoadRequest plan(int64_t step) const;
  int64_t steps_per_epoch() const { return static_cast<int64_t>(views_of_frame_.size()); }

 private:
  std::vector<LoadRequest> views_of_frame_;
  int views_per_step_;
  uint64_t seed_;
};

}  // namespace degas
