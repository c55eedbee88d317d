#include "host/ops/ssim.h"

#include <fmt/format.h>

#include <stdexcept>

#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"

namespace degas {
namespace {

// As in kernels/common/ssim.cl, ssim_wide.cl and ssim_gpu.cl.
constexpr int64_t strip_vectors = 16, rows_per_item = 4, tile = 16, window_radius = 5;

struct Geometry {
  int height, row_length, pitch;
  int64_t channels;
  Range global, local;
  int64_t partials;
};

Geometry geometry_of(const Device& device, const Tensor& image) {
  const int64_t height = image.dim(0), width = image.dim(1), channels = image.dim(2), vector = device.vector_width();
  const int64_t row_length = width * channels, pitch = (row_length + vector - 1) / vector * vector;
  Geometry geometry{
      static_cast<int>(height), static_cast<int>(row_length), static_cast<int>(pitch), channels, {}, {}, 0};
  if (device.is_wide()) {
    const size_t strips = (pitch + strip_vectors * vector - 1) / (strip_vectors * vector);
    const size_t bands = (height + rows_per_item - 1) / rows_per_item;
    geometry.global = {strips, bands};
    geometry.local = {1, 1};
    geometry.partials = static_cast<int64_t>(strips * bands);
  } else {
    const size_t across = (width + tile - 1) / tile, down = (height + tile - 1) / tile;
    geometry.global = {across * tile, down * tile, static_cast<size_t>(channels)};
    geometry.local = {tile, tile, 1};
    geometry.partials = static_cast<int64_t>(across * down) * channels;
  }
  return geometry;
}

Kernel ssim_kernel(Device& device, const char* name, const Geometry& geometry) {
  return device.kernel(device.is_wide() ? "ssim_wide" : "ssim_gpu", name, {{"CHANNELS", geometry.channels}});
}

void require_images(const char* operation, const Tensor& image, const Tensor& target) {
  const int64_t most_channels = 3;  // what the wide kernel's one vector on either side of a strip has room for
  if (image.shape() != target.shape() || image.shape().size() != 3 || image.dim(2) < 1 ||
      image.dim(2) > most_channels) {
    throw std::logic_error(fmt::format("[{}] needs two (H,W,1..3) images of one size, got {} and {}", operation,
                                       to_string(image.shape()), to_string(target.shape())));
  }
}

/// l1_factor * sum |d| + ssim_factor * sum (1 - SSIM); fills derivative when it is defined.
Tensor weighted_sums(const Tensor& image, const Tensor& target, const Tensor& derivative, double l1_factor,
                     double ssim_factor, int margin) {
  Device& device = image.device();
  const Geometry geometry = geometry_of(device, image);
  const Tensor partial(device, {geometry.partials});
  ssim_kernel(device, "ssim_forward", geometry)
      .launch(geometry.global, geometry.local, image, target, derivative, partial, l1_factor, ssim_factor,
              geometry.height, geometry.row_length, geometry.pitch, margin);
  Tape silent(device, false);
  return sum(silent, partial);
}

}  // namespace

Tensor l1_ssim_loss(Tape& tape, const Tensor& image, const Tensor& target, double ssim_weight) {
  require_images("l1_ssim_loss", image, target);
  const auto count = static_cast<double>(image.size());
  const double l1_factor = (1 - ssim_weight) / count, ssim_factor = ssim_weight / count;
  if (!tape.needs_gradient({image})) return weighted_sums(image, target, {}, l1_factor, ssim_factor, 0);
  // The gradient is made at once: it is a third of the derivatives that it comes from.
  const Geometry geometry = geometry_of(tape.device(), image);
  const Tensor derivative(tape.device(), {3, geometry.height, geometry.pitch}), gradient(tape.device(), image.shape());
  const Tensor loss = weighted_sums(image, target, derivative, l1_factor, ssim_factor, 0);
  ssim_kernel(tape.device(), "ssim_backward", geometry)
      .launch(geometry.global, geometry.local, image, target, derivative, gradient, l1_factor, ssim_factor,
              geometry.height, geometry.row_length, geometry.pitch);
  tape.record("l1_ssim_loss", {image}, {loss}, [=, image = image.without_values()](Tape& tape) {
    scale_in_place(gradient, loss.gradient());
    tape.accumulate(image, gradient);
  });
  return loss;
}

Tensor ssim(const Tensor& image, const Tensor& target) {
  require_images("ssim", image, target);
  const int64_t height = image.dim(0) - 2 * window_radius, width = image.dim(1) - 2 * window_radius;
  if (height < 1 || width < 1) {
    throw std::logic_error(fmt::format("[ssim] {} is smaller than the 11x11 window", to_string(image.shape())));
  }
  const double factor = 1.0 / static_cast<double>(height * width * image.dim(2));
  Tape silent(image.device(), false);
  return scale(silent, weighted_sums(image, target, {}, 0, factor, window_radius), -1, 1);
}

}  // namespace degas
