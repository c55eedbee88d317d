#include "model/loss/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "host/ops/ssim.h"

namespace degas {
namespace {

constexpr int person_margin = 50, person_side = 512, box_side = 256;
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

double cosine_distance(std::span<const float> a, std::span<const float> b) {
  if (a.size() != b.size() || a.empty()) {
    throw std::logic_error(fmt::format("[cosine distance] {} values against {}", a.size(), b.size()));
  }
  double product = 0, square_a = 0, square_b = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    product += static_cast<double>(a[i]) * b[i];
    square_a += static_cast<double>(a[i]) * a[i];
    square_b += static_cast<double>(b[i]) * b[i];
  }
  const double lengths = std::sqrt(square_a * square_b);
  return lengths == 0 ? 1 : 1 - product / lengths;
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

MeasuredRegion whole_region(const Image8& picture, const Rectangle& person) {
  return {{0, 0, picture.width, picture.height}, grown_square(person, person_margin), person_side};
}

std::optional<MeasuredRegion> box_region(const Image8& picture, const Rectangle& box) {
  const Rectangle inside = clipped(box, picture.width, picture.height);
  if (std::min(inside.width, inside.height) < smallest_box) return {};
  return MeasuredRegion{inside, grown_square(box, 0), box_side};
}

QualityMeter::QualityMeter(Device& device, const std::vector<std::vector<LpipsLayer>>& lpips) : device_(device) {
  for (const std::vector<LpipsLayer>& layers : lpips) lpips_.emplace_back(device, layers);
}

Tensor QualityMeter::square(const Image8& image, const MeasuredRegion& region) const {
  Tape tape(device_, false);
  return resize(tape, crop(tape, tensor_of(device_, image), region.square, white), region.side, region.side);
}

ImageQuality QualityMeter::measure(const Image8& image, const Image8& target, const MeasuredRegion& region) const {
  require_pair(image, target);
  const Rectangle& inside = region.inside;
  const Image8 a = cropped(image, inside.left, inside.top, inside.width, inside.height);
  const Image8 b = cropped(target, inside.left, inside.top, inside.width, inside.height);
  ImageQuality quality{
      psnr(floats_of(a), floats_of(b)), ssim(tensor_of(device_, a), tensor_of(device_, b)).to_host<double>()[0], {}};
  if (lpips_.empty()) return quality;
  Tape tape(device_, false);
  const Tensor image_square = square(image, region), target_square = square(target, region);
  for (const Lpips& lpips : lpips_) {
    quality.lpips.push_back(lpips.distance(tape, image_square, target_square).to_host<double>()[0]);
  }
  return quality;
}

}  // namespace degas
