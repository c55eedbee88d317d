#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// Bilinear enlargement (N, H, W, C) -> (N, 2H, 2W, C) with aligned corners, as torch's
/// interpolate(scale_factor=2, mode="bilinear", align_corners=True). A backward pass that reads the values makes them
/// anew from `input` (Tensor::kept).
Tensor upsample(Tape& tape, const Tensor& input);

/// base + upsample(input): base (N, 2H, 2W, C).
Tensor add_upsampled(Tape& tape, const Tensor& base, const Tensor& input);

}  // namespace degas
