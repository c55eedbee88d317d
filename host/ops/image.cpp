#include "host/ops/image.h"

#include <fmt/format.h>

#include <stdexcept>

namespace degas {
namespace {

Range one_item_per_element(const Tensor& tensor) {
  return {static_cast<size_t>(tensor.size())};
}

}  // namespace

Tensor composite(const Tensor& color, const Tensor& mask, const std::array<double, 3>& background) {
  if (color.element() != Element::UInt8 || mask.element() != Element::UInt8 || color.shape().size() != 3 ||
      color.dim(2) != 3 || mask.size() * 3 != color.size()) {
    throw std::logic_error(fmt::format("[composite] needs bytes (H,W,3) and a mask (H,W), got {} and {}",
                                       to_string(color.shape()), to_string(mask.shape())));
  }
  Device& device = color.device();
  const Tensor output(device, color.shape());
  device.kernel("image", "composite")
      .launch(one_item_per_element(mask), device.pointwise_local(), color, mask, output, background[0], background[1],
              background[2], mask.size());
  return output;
}

Tensor crop(Tape& tape, const Tensor& image, const Rectangle& r, const std::array<double, 3>& outside) {
  if (image.shape().size() != 3 || image.dim(2) != 3 || r.width < 1 || r.height < 1) {
    throw std::logic_error(
        fmt::format("[crop] cannot cut {} x {} pixels out of {}", r.width, r.height, to_string(image.shape())));
  }
  Device& device = tape.device();
  const int height = static_cast<int>(image.dim(0)), width = static_cast<int>(image.dim(1));
  const Tensor output(device, {r.height, r.width, 3});
  device.kernel("image", "crop")
      .launch(one_item_per_element(output), device.pointwise_local(), image, output, height, width, r.top, r.left,
              r.width, outside[0], outside[1], outside[2], output.size());
  tape.record("crop", {image}, {output}, [=](Tape& tape) {
    tape.accumulate(image, [&](const Tensor& gradient) {
      Device& device = tape.device();
      device.kernel("image", "crop_gradient")
          .launch(one_item_per_element(gradient), device.pointwise_local(), output.gradient(), gradient, width, r.top,
                  r.left, r.height, r.width, gradient.size());
    });
  });
  return output;
}

Tensor resize(Tape& tape, const Tensor& image, int out_height, int out_width) {
  if (image.shape().size() != 3 || out_height < 1 || out_width < 1) {
    throw std::logic_error(
        fmt::format("[resize] cannot bring {} to {} x {}", to_string(image.shape()), out_width, out_height));
  }
  Device& device = tape.device();
  const int height = static_cast<int>(image.dim(0)), width = static_cast<int>(image.dim(1));
  const int channels = static_cast<int>(image.dim(2));
  const Tensor output(device, {out_height, out_width, channels});
  device.kernel("image", "resize")
      .launch(one_item_per_element(output), device.pointwise_local(), image, output, height, width, out_height,
              out_width, channels, output.size());
  tape.record("resize", {image}, {output}, [=](Tape& tape) {
    tape.accumulate(image, [&](const Tensor& gradient) {
      Device& device = tape.device();
      device.kernel("image", "resize_gradient")
          .launch(one_item_per_element(gradient), device.pointwise_local(), output.gradient(), gradient, height, width,
                  out_height, out_width, channels, gradient.size());
    });
  });
  return output;
}

}  // namespace degas
