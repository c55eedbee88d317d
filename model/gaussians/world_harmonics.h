#pragma once

#include <vector>

#include "host/ops/splat.h"

namespace degas {

/// The harmonics of splats in the world's axes, (N,K,3), as 3DGS viewers want them: ours turn with each Gaussian
/// (host/ops/harmonics.h). A rotation mixes only harmonics of one degree, so the result is exact: it is fitted to what
/// the operator itself shows from more directions than there are coefficients. Needs defined harmonics.
std::vector<float> world_harmonics(Tape& tape, const Splats& splats);

}  // namespace degas
