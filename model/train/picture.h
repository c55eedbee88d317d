#pragma once

#include <array>
#include <vector>

#include "host/autograd/tensor.h"
#include "host/io/image.h"
#include "host/ops/splat.h"
#include "model/config.h"
#include "model/data/capture.h"

namespace degas {

/// How a config wants splats drawn.
SplatOptions splat_options(const RenderConfig& config);

/// A rendered (H,W,3) image in 0..1 as 8-bit RGB, rounded to nearest; what is not finite becomes 0.
Image8 to_image8(const Tensor& image);

/// The photograph over a background colour (0..255 each), rounded to nearest.
Image8 over_background(const Sample& sample, const std::array<int, 3>& background);

/// Truth, render and their absolute difference times 4, side by side.
Image8 comparison_sheet(const Image8& truth, const Image8& render);

}  // namespace degas
