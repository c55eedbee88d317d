#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// Maximum over windows of 2x2 or 3x3 pixels at stride 2, no padding; input (N,H,W,C) with sides of at least `window`.
/// Output sides: (side - window) / 2 + 1, rounded down, or up with ceil_mode (a last window then hangs over the border).
Tensor max_pool(Tape& tape, const Tensor& input, bool ceil_mode, int window = 3);

}  // namespace degas
