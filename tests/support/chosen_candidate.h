#pragma once

#include <algorithm>

#include "host/device/tuner.h"

namespace degas::test {

/// Runs every launch with the candidate of a given number (of shorter lists, with one of the others), untimed.
class ChosenCandidate : public Tuner {
 public:
  ChosenCandidate(Device& device, size_t number) : Tuner(device, TuneMode::Full, {}), number_(number) {}

  Parameters choose(const TunedKernel&, const std::string&, const std::function<Tunable()>& describe) override {
    const std::vector<Parameters> candidates = describe().candidates;
    longest_ = std::max(longest_, candidates.size());
    return candidates[number_ % candidates.size()];
  }
  /// Of the lists so far.
  size_t longest() const { return longest_; }

 private:
  size_t number_, longest_ = 0;
};

}  // namespace degas::test
