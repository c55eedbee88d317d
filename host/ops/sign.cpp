#include "host/ops/sign.h"

namespace degas {
namespace {

int64_t words_of(const Tensor& values) {
  return (values.size() + 15) / 16;
}

}  // namespace

Tensor pack_signs(const Tensor& values) {
  Device& device = values.device();
  const int64_t words = words_of(values);
  const Tensor signs(device, {words, 2}, Element::UInt8);
  device.kernel("sign", "pack_signs")
      .launch({static_cast<size_t>(words)}, device.pointwise_local(), values, signs, words);
  return signs;
}

void leaky_relu_gradient(const Tensor& gradient, const Tensor& signs, double negative_slope, const Tensor& target) {
  Device& device = gradient.device();
  const int64_t words = words_of(gradient);
  device.kernel("sign", "leaky_relu_gradient")
      .launch({static_cast<size_t>(words)}, device.pointwise_local(), gradient, signs, target, negative_slope, words);
}

}  // namespace degas
