#pragma once

#include <optional>
#include <span>

#include "host/io/image.h"
#include "host/ops/image.h"
#include "host/ops/lpips.h"

namespace degas {

/// Peak signal-to-noise ratio in dB of values in 0..1 (others are clamped): -10 log10 of the mean squared difference,
/// at most 100 (equal images). Throws std::logic_error on different or no sizes; NaN gives NaN.
double psnr(std::span<const float> image, std::span<const float> target);

struct ImageQuality {
  double psnr = 0, ssim = 0;
  std::optional<double> lpips;  ///< where there are weights
};

/// `box` grown by `margin` pixels on each side, then on its shorter sides to a square about the same middle.
Rectangle grown_square(const Rectangle& box, int margin);
/// The part of a rectangle that lies within a picture of that size; empty width or height when none does.
Rectangle clipped(const Rectangle& rectangle, int width, int height);

/// The evaluation protocol of method.md on 8-bit RGB pictures over a white background.
class QualityMeter {
 public:
  /// lpips_layers: empty for no LPIPS.
  QualityMeter(Device& device, const std::vector<LpipsLayer>& lpips_layers);

  /// PSNR and SSIM (valid region) of the whole picture; LPIPS of the person's box grown by 50 px and squared, at
  /// 512x512.
  ImageQuality picture(const Image8& image, const Image8& target, const Rectangle& person) const;
  /// PSNR and SSIM within the box; LPIPS of the box squared, at 256x256. Nothing when fewer than 11 pixels of a side of
  /// the box lie within the picture.
  std::optional<ImageQuality> box(const Image8& image, const Image8& target, const Rectangle& box) const;

 private:
  std::optional<double> perceptual(const Tensor& image, const Tensor& target, const Rectangle& square, int side) const;

  Device& device_;
  std::optional<Lpips> lpips_;
};

}  // namespace degas
