#include "host/ops/region.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

namespace degas {
namespace {

/// Mirrors Region of kernels/region.cl.
struct Region {
  int image_height, image_width, image_channels;
  int height, width, channels;
  int top, left, first_channel;
  int used_channels;
};

int pixels_of(const Tensor& image) {
  return static_cast<int>(image.size() / image.dim(-1));
}
int channels_of(const Tensor& image) {
  return static_cast<int>(image.dim(-1));
}

Shape with_channels(Shape shape, int64_t channels) {
  shape.back() = channels;
  return shape;
}

/// One item per pixel of `target_like`, whose number of pixels is the last argument.
template <typename... Arguments>
void launch_pixels(const char* name, const Tensor& target_like, const Arguments&... arguments) {
  Device& device = target_like.device();
  const int pixels = pixels_of(target_like);
  device.kernel("region", name).launch({static_cast<size_t>(pixels)}, {64}, arguments..., pixels);
}

void copy_channels(const Tensor& source, int source_first, const Tensor& target, int target_first, int count) {
  launch_pixels("copy_channels", target, source, channels_of(source), source_first, target, channels_of(target),
                target_first, count);
}

void require(bool holds, const char* operation, const Tensor& a, const Tensor& b) {
  if (!holds) {
    throw std::logic_error(
        fmt::format("[{}] shapes do not fit: {} and {}", operation, to_string(a.shape()), to_string(b.shape())));
  }
}

void tile_masked_backward(const Tensor& mask, const Tensor& output_gradient, const Tensor& gradient) {
  Device& device = mask.device();
  const int images = static_cast<int>(gradient.dim(0)), channels = channels_of(mask), pixels = pixels_of(mask);
  const int chunk_pixels = std::max(16, (pixels + 63) / 64);
  const int chunks = (pixels + chunk_pixels - 1) / chunk_pixels;
  const Tensor partial(device, {chunks, images, channels});
  device.kernel("region", "tile_masked_backward")
      .launch({static_cast<size_t>(channels), static_cast<size_t>(chunks), static_cast<size_t>(images)}, {32, 1, 1},
              mask, output_gradient, partial, channels, pixels, chunk_pixels, images);
  device.kernel("region", "sum_chunks")
      .launch({static_cast<size_t>(gradient.size())}, {64}, partial, gradient, chunks,
              static_cast<int>(gradient.size()));
}

/// What of tensors a backward pass keeps that only moves gradients.
std::vector<Tensor> without_values(std::vector<Tensor> tensors) {
  for (Tensor& tensor : tensors) tensor = tensor.without_values();
  return tensors;
}

}  // namespace

Tensor tile_masked(Tape& tape, const Tensor& values, const Tensor& mask) {
  require(mask.shape().size() == 3 && values.shape().size() == 2 && values.dim(1) == mask.dim(2), "tile_masked", values,
          mask);
  const Tensor output(tape.device(), {values.dim(0), mask.dim(0), mask.dim(1), mask.dim(2)});
  launch_pixels("tile_masked", output, values, mask, output, channels_of(mask), pixels_of(mask));
  tape.record("tile_masked", {values}, {output}, [=](Tape& tape) {
    tape.accumulate(values, [&](const Tensor& gradient) { tile_masked_backward(mask, output.gradient(), gradient); });
  });
  return output;
}

Tensor overwrite_region(Tape& tape, const Tensor& base, const Tensor& patch, int top, int left, int first_channel) {
  require(base.shape().size() == 4 && patch.shape().size() == 4 && base.dim(0) == patch.dim(0) && top >= 0 &&
              left >= 0 && top + patch.dim(1) <= base.dim(1) && left + patch.dim(2) <= base.dim(2) &&
              first_channel >= 0 && first_channel < base.dim(3),
          "overwrite_region", base, patch);
  const auto size = [](const Tensor& tensor, int axis) { return static_cast<int>(tensor.dim(axis)); };
  const Region region{size(base, 1),
                      size(base, 2),
                      size(base, 3),
                      size(patch, 1),
                      size(patch, 2),
                      size(patch, 3),
                      top,
                      left,
                      first_channel,
                      std::min(size(patch, 3), size(base, 3) - first_channel)};
  const Tensor output(tape.device(), base.shape());
  launch_pixels("overwrite_region", output, base, patch, output, region);
  tape.record("overwrite_region", {base, patch}, {output}, [=](Tape& tape) {
    const Tensor gradient = output.gradient();
    tape.accumulate(base, [&](const Tensor& target) {
      launch_pixels("overwrite_region_base_backward", target, gradient, target, region);
    });
    tape.accumulate(patch, [&](const Tensor& target) {
      launch_pixels("overwrite_region_patch_backward", target, gradient, target, region);
    });
  });
  return output;
}

Tensor concat_channels(Tape& tape, const std::vector<Tensor>& images) {
  if (images.size() == 1) return images[0];
  int channels = 0;
  for (const Tensor& image : images) {
    require(pixels_of(image) == pixels_of(images[0]), "concat_channels", image, images[0]);
    channels += channels_of(image);
  }
  const Tensor output(tape.device(), with_channels(images.at(0).shape(), channels));
  int first = 0;
  for (const Tensor& image : images) {
    copy_channels(image, 0, output, first, channels_of(image));
    first += channels_of(image);
  }
  tape.record("concat_channels", images, {output},
              [images = without_values(images), output = output.without_values()](Tape& tape) {
                int first = 0;
                for (const Tensor& image : images) {
                  tape.accumulate(image, [&](const Tensor& target) {
                    copy_channels(output.gradient(), first, target, 0, channels_of(image));
                  });
                  first += channels_of(image);
                }
              });
  return output;
}

std::vector<Tensor> split_channels(Tape& tape, const Tensor& image, const std::vector<int>& counts) {
  if (std::accumulate(counts.begin(), counts.end(), 0) != channels_of(image)) {
    throw std::logic_error(
        fmt::format("[split_channels] counts do not sum to the channels of {}", to_string(image.shape())));
  }
  std::vector<Tensor> parts;
  int first = 0;
  for (const int count : counts) {
    parts.emplace_back(tape.device(), with_channels(image.shape(), count));
    copy_channels(image, first, parts.back(), 0, count);
    first += count;
  }
  tape.record("split_channels", {image}, parts,
              [image = image.without_values(), parts = without_values(parts)](Tape& tape) {
                tape.accumulate(image, [&](const Tensor& target) {
                  int first = 0;
                  for (const Tensor& part : parts) {
                    copy_channels(tape.gradient_or_zeros(part), 0, target, first, channels_of(part));
                    first += channels_of(part);
                  }
                });
              });
  return parts;
}

Tensor repeat_channels(Tape& tape, const Tensor& image, int times) {
  const int channels = channels_of(image);
  const Tensor output(tape.device(), with_channels(image.shape(), int64_t{channels} * times));
  launch_pixels("repeat_channels", output, image, output, channels, times);
  tape.record("repeat_channels", {image}, {output},
              [=, image = image.without_values(), output = output.without_values()](Tape& tape) {
                tape.accumulate(image, [&](const Tensor& gradient) {
                  launch_pixels("repeat_channels_backward", gradient, output.gradient(), gradient, channels, times);
                });
              });
  return output;
}

}  // namespace degas
