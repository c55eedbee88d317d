#include "model/data/foreground.h"

#include <algorithm>

#include "host/error.h"

namespace degas {
namespace {

/// Alpha from which a pixel counts as the person's when a mask is asked whether it is empty.
constexpr int opaque = 128;

/// Turns colours into colour times alpha, in place.
void premultiply(Image8& colour, const Image8& alpha, Background background) {
  for (size_t i = 0; i < alpha.pixels.size(); ++i) {
    const int a = alpha.pixels[i];
    if (a == 255) continue;
    uint8_t* const pixel = &colour.pixels[3 * i];
    if (a == 0) {
      std::fill_n(pixel, 3, uint8_t{0});
      continue;
    }
    for (int c = 0; c < 3; ++c) {
      // Over paper of colour B a picture holds alpha F + (1 - alpha) B. Compression leaves values beyond 0..alpha.
      const int foreground = background == Background::White   ? pixel[c] - (255 - a)
                             : background == Background::Black ? pixel[c]
                                                               : (pixel[c] * a + 127) / 255;
      pixel[c] = static_cast<uint8_t>(std::clamp(foreground, 0, a));
    }
  }
}

}  // namespace

Background measured_background(const Image8& colour, const Image8& alpha) {
  size_t outside = 0, white = 0, black = 0;
  for (size_t i = 0; i < alpha.pixels.size(); ++i) {
    if (alpha.pixels[i] > 2) continue;
    const auto [low, high] = std::minmax({colour.pixels[3 * i], colour.pixels[3 * i + 1], colour.pixels[3 * i + 2]});
    ++outside;
    white += low > 225;
    black += high < 30;
  }
  if (10 * white > 9 * outside) return Background::White;
  return 10 * black >= 9 * outside ? Background::Black : Background::Scene;
}

Sample make_sample(const FrameCamera& place, const Camera& view, Image8 colour, const Image8& alpha,
                   Background background, const std::string& source, const std::string& camera_name) {
  if (std::none_of(alpha.pixels.begin(), alpha.pixels.end(), [](uint8_t a) { return a >= opaque; })) {
    throw Error::format("{}: frame {} of {} has an empty mask", source, place.frame, camera_name);
  }
  premultiply(colour, alpha, background);
  return {place.frame, place.camera, view, resized(colour, view.width, view.height),
          resized(alpha, view.width, view.height)};
}

}  // namespace degas
