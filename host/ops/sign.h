#pragma once

#include "host/autograd/tensor.h"

namespace degas {

/// Which elements are above 0, a bit each: an opaque tensor of a thirty-second of the bytes, outside any tape.
Tensor pack_signs(const Tensor& values);
/// target = gradient where pack_signs found the leaky ReLU's output above 0, else negative_slope * gradient; of equal
/// sizes. target may be gradient.
void leaky_relu_gradient(const Tensor& gradient, const Tensor& signs, double negative_slope, const Tensor& target);

}  // namespace degas
