#include "model/loss/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "host/ops/ssim.h"

namespace degas {
namespace {

constexpr int person_margin = 50, person_side = 512, face_side = 256;
constexpr int smallest_box = 11;  // SSIM's window
constexpr std::array<double, 3> white{1, 1, 1};

std::vector<float> floats_of(const Image8& image) {
  std::vector<float> values(image.pixels.size());
  std::transform(image.pixels.begin(), image.pixels.end(), values.begin(), [](uint8_t byte) { return byte / 255.0f; });
  return values;
}

Tensor tensor_of(Device& device, const Image8& image) {
  return Tensor::from(device, {image.height, image.width, 3}, std::span<const float>(floats_of(image)));
}

void require_pair(const Image8& image, const Image8& target) {
  if (image.width != target.width || image.height != target.height || image.channels != 3 || target.channels != 3) {
    throw std::logic_error(fmt::format("[metrics] needs two RGB pictures of one size, got {}x{}x{} and {}x{}x{}",
                                       image.width, image.height, image.channels, target.width, target.height,
                                       target.channels));
  }
}

}  // namespace

double psnr(std::span<const float> image, std::span<const float> target) {
  if (image.size() != target.size() || image.empty()) {
    throw std::logic_error(fmt::format("[psnr] {} values against {}", image.size(), target.size()));
  }
  double squares = 0;
  for (size_t i = 0; i < image.size(); ++i) {
    const double difference = std::clamp<double>(image[i], 0, 1) - std::clamp<double>(target[i], 0, 1);
    squares += difference * difference;
  }
  const double mean = squares / static_cast<double>(image.size());
  return mean < 1e-10 ? 100 : -10 * std::log10(mean);
}

Rectangle grown_square(const Rectangle& box, int margin) {
  const int side = std::max(box.width, box.height) + 2 * margin;
  return {box.left + box.width / 2 - side / 2, box.top + box.height / 2 - side / 2, side, side};
}

Rectangle clipped(const Rectangle& rectangle, int width, int height) {
  const int left = std::clamp(rectangle.left, 0, width), top = std::clamp(rectangle.top, 0, height);
  const int right = std::clamp(rectangle.left + rectangle.width, left, std::max(left, width));
  const int bottom = std::clamp(rectangle.top + rectangle.height, top, std::max(top, height));
  return {left, top, right - left, bottom - top};
}

QualityMeter::QualityMeter(Device& device, const std::vector<LpipsLayer>& lpips_layers) : device_(device) {
  if (!lpips_layers.empty()) lpips_.emplace(device, lpips_layers);
}

std::optional<double> QualityMeter::perceptual(const Tensor& image, const Tensor& target, const Rectangle& square,
                                               int side) const {
  if (!lpips_) return {};
  Tape tape(device_, false);
  const auto cut = [&](const Tensor& picture) { return resize(tape, crop(tape, picture, square, white), side, side); };
  return lpips_->distance(tape, cut(image), cut(target)).to_host<double>()[0];
}

ImageQuality QualityMeter::picture(const Image8& image, const Image8& target, const Rectangle& person) const {
  require_pair(image, target);
  const Tensor a = tensor_of(device_, image), b = tensor_of(device_, target);
  return {psnr(floats_of(image), floats_of(target)), ssim(a, b).to_host<double>()[0],
          perceptual(a, b, grown_square(person, person_margin), person_side)};
}

std::optional<ImageQuality> QualityMeter::box(const Image8& image, const Image8& target, const Rectangle& box) const {
  require_pair(image, target);
  const Rectangle inside = clipped(box, image.width, image.height);
  if (std::min(inside.width, inside.height) < smallest_box) return {};
  const auto cut = [&](const Image8& picture) {
    return cropped(picture, inside.left, inside.top, inside.width, inside.height);
  };
  const Image8 a = cut(image), b = cut(target);
  return ImageQuality{
      psnr(floats_of(a), floats_of(b)), ssim(tensor_of(device_, a), tensor_of(device_, b)).to_host<double>()[0],
      perceptual(tensor_of(device_, image), tensor_of(device_, target), grown_square(box, 0), face_side)};
}

}  // namespace degas
