#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// Bilinear enlargement (N, H, W, C) -> (N, 2H, 2W, C) with aligned corners, as torch's
/// interpolate(scale_factor=2, mode="bilinear", align_corners=True).
Tensor upsample(Tape& tape, const Tensor& input);

}  // namespace degas
