#pragma once

#include <vector>

#include "host/autograd/tape.h"

namespace degas {

/// output[n, h, w, c] = values[n, c] * mask[h, w, c]: values (N, C), mask (H, W, C), which gets no gradient.
Tensor tile_masked(Tape& tape, const Tensor& values, const Tensor& mask);

/// base (N, H, W, C) with the rectangle at (top, left) of the patch's size (N, h, w, P) replaced by the patch, from
/// channel first_channel on; the patch's last channels fall away where C has no room for them. The gradient of what was
/// replaced goes to the patch.
Tensor overwrite_region(Tape& tape, const Tensor& base, const Tensor& patch, int top, int left, int first_channel = 0);

/// Images (N, H, W, C_i) side by side in channels: (N, H, W, sum C_i).
Tensor concat_channels(Tape& tape, const std::vector<Tensor>& images);
/// The reverse; counts must sum to C.
std::vector<Tensor> split_channels(Tape& tape, const Tensor& image, const std::vector<int>& counts);
/// (N, H, W, C) -> (N, H, W, times * C), all channels over and over.
Tensor repeat_channels(Tape& tape, const Tensor& image, int times);

}  // namespace degas
