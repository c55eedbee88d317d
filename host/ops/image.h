#pragma once

#include <array>

#include "host/autograd/tape.h"

namespace degas {

/// color / 255 + (1 - mask / 255) * background. color: UInt8 (H,W,3), already multiplied by mask; mask: UInt8 (H,W).
/// Gives Real (H,W,3); no gradient.
Tensor composite(const Tensor& color, const Tensor& mask, const std::array<double, 3>& background);

/// Pixels, x to the right and y down from the top-left corner.
struct Rectangle {
  int left = 0, top = 0, width = 0, height = 0;
};

/// The rectangle of image (H,W,3); what lies outside the image has the colour `outside`.
Tensor crop(Tape& tape, const Tensor& image, const Rectangle& rectangle, const std::array<double, 3>& outside);

/// image (H,W,C) at another size. An axis that shrinks averages areas, one that grows interpolates linearly between
/// pixel centres. Sides up to 30,000.
Tensor resize(Tape& tape, const Tensor& image, int height, int width);

}  // namespace degas
