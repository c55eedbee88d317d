#pragma once

#include "bench/stability/stress.h"

namespace degas::bench {

/// A Gaussian half-way between two joints, of which one is twisted: how far its covariance is from that of a Gaussian
/// turned by half the angle, or, as 180 degrees may be halved either way round, by 180 degrees less.
StressAxis twist_axis(const std::vector<StressedDevice>& devices);

}  // namespace degas::bench
