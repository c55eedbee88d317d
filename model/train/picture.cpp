#include "model/train/picture.h"

#include <algorithm>
#include <cstdlib>

namespace degas {

SplatOptions splat_options(const RenderConfig& config) {
  SplatOptions options;
  options.antialias = config.antialias;
  options.near_plane = config.near_plane;
  options.blur = config.blur;
  return options;
}

Image8 to_image8(const Tensor& image) {
  Image8 result = Image8::black(static_cast<int>(image.dim(1)), static_cast<int>(image.dim(0)), 3);
  const std::vector<float> values = image.to_host<float>();
  for (size_t i = 0; i < values.size(); ++i) {
    // Phrased so that a NaN fails the first test.
    result.pixels[i] = !(values[i] > 0) ? 0 : static_cast<uint8_t>(std::min(values[i], 1.0f) * 255.0f + 0.5f);
  }
  return result;
}

Image8 over_background(const Sample& sample, const std::array<int, 3>& background) {
  Image8 result = sample.image;
  for (size_t pixel = 0; pixel < sample.mask.pixels.size(); ++pixel) {
    const int transparent = 255 - sample.mask.pixels[pixel];
    for (int channel = 0; channel < 3; ++channel) {
      const int value = result.pixels[3 * pixel + channel] + (transparent * background[channel] + 127) / 255;
      result.pixels[3 * pixel + channel] = static_cast<uint8_t>(std::min(value, 255));
    }
  }
  return result;
}

Image8 comparison_sheet(const Image8& truth, const Image8& render) {
  Image8 sheet = Image8::black(3 * truth.width, truth.height, 3);
  for (int y = 0; y < truth.height; ++y) {
    for (int x = 0; x < truth.width; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        const int a = truth.at(x, y)[channel], b = render.at(x, y)[channel];
        sheet.at(x, y)[channel] = static_cast<uint8_t>(a);
        sheet.at(truth.width + x, y)[channel] = static_cast<uint8_t>(b);
        sheet.at(2 * truth.width + x, y)[channel] = static_cast<uint8_t>(std::min(255, 4 * std::abs(a - b)));
      }
    }
  }
  return sheet;
}

}  // namespace degas
