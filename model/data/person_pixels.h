#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "host/io/image.h"

namespace degas {

/// A picture over black and its mask as bytes that hold the person's pixels only: for every row the number of runs of
/// pixels whose alpha is above 0 (uint16), and for each run its first column and length (uint16) and its pixels (RGB
/// and alpha).
std::vector<std::byte> pack_person(const Image8& image, const Image8& mask);

/// The inverse, into pictures of the given size that are zeroed first. False when the bytes are damaged.
bool unpack_person(std::span<const std::byte> bytes, int width, int height, Image8& image, Image8& mask);

}  // namespace degas
