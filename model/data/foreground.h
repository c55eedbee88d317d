#pragma once

#include <string>

#include "model/data/capture.h"

namespace degas {

/// What lies behind the person in a capture's pictures: white or black paper (colours are blended with it by alpha), or
/// the scene (colours are whole).
enum class Background { White, Black, Scene };

/// Seen in the pixels that alpha (1 channel) calls empty: paper where nine in ten of them are white or black.
Background measured_background(const Image8& colour, const Image8& alpha);

/// A Sample of a picture and its alpha at full size: colour times alpha, both brought to the size of `view`. Error
/// where alpha shows nobody; `source` and `camera_name` name the picture in it.
Sample make_sample(const FrameCamera& place, const Camera& view, Image8 colour, const Image8& alpha,
                   Background background, const std::string& source, const std::string& camera_name);

}  // namespace degas
