#pragma once

#include <optional>
#include <span>
#include <vector>

#include "host/io/image.h"
#include "host/ops/image.h"
#include "host/ops/lpips.h"

namespace degas {

/// Peak signal-to-noise ratio in dB of values in 0..1 (others are clamped): -10 log10 of the mean squared difference,
/// at most 100 (equal images). Throws std::logic_error on different or no sizes; NaN gives NaN.
double psnr(std::span<const float> image, std::span<const float> target);

/// 1 - the cosine of the angle between two codes of one size (std::logic_error); 1 where one is zero throughout. The
/// distance that AED averages.
double cosine_distance(std::span<const float> a, std::span<const float> b);

struct ImageQuality {
  double psnr = 0, ssim = 0;
  std::vector<double> lpips;  ///< by each of the meter's networks
};

/// `box` grown by `margin` pixels on each side, then on its shorter sides to a square about the same middle.
Rectangle grown_square(const Rectangle& box, int margin);
/// The part of a rectangle that lies within a picture of that size; empty width or height when none does.
Rectangle clipped(const Rectangle& rectangle, int width, int height);

/// The part of a picture that a figure is of.
struct MeasuredRegion {
  Rectangle inside;  ///< what PSNR and SSIM see; lies within the picture
  Rectangle square;  ///< what networks (LPIPS, FID) see; may reach over the border, where it is white ..
  int side = 0;      ///< .. after it is brought to so many pixels
};
/// The whole picture; for networks the person's box grown by 50 px and squared, at 512x512.
MeasuredRegion whole_region(const Image8& picture, const Rectangle& person);
/// The part of a box within the picture; for networks the whole box squared, at 256x256. Nothing when fewer than 11
/// pixels of a side lie within the picture, SSIM's window.
std::optional<MeasuredRegion> box_region(const Image8& picture, const Rectangle& box);

/// The evaluation protocol of method.md on 8-bit RGB pictures over a white background.
class QualityMeter {
 public:
  /// lpips: the layers of each network to measure LPIPS by; may be empty.
  QualityMeter(Device& device, const std::vector<std::vector<LpipsLayer>>& lpips);

  /// PSNR, SSIM (valid region) and LPIPS of two pictures of one size (std::logic_error).
  ImageQuality measure(const Image8& image, const Image8& target, const MeasuredRegion& region) const;
  /// The region's square, (side,side,3) in 0..1: what networks are given.
  Tensor square(const Image8& image, const MeasuredRegion& region) const;

 private:
  Device& device_;
  std::vector<Lpips> lpips_;
};

}  // namespace degas
