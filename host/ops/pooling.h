#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// Maximum over 3x3 windows at stride 2, no padding; input (N,H,W,C) with sides of at least 3. Output sides:
/// (side - 3) / 2 + 1, rounded down, or up with ceil_mode (a last window then hangs over the border).
Tensor max_pool(Tape& tape, const Tensor& input, bool ceil_mode);

}  // namespace degas
