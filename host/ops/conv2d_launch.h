#pragma once

#include "host/autograd/tensor.h"
#include "host/ops/conv2d.h"

namespace degas {

/// Sizes of one convolution.
struct Conv2dGeometry {
  int batch, height, width, channels;
  int output_height, output_width, output_channels;
  int kernel_size;
  int stride, padding, groups;

  /// Channels of one group.
  int depth() const { return channels / groups; }
  int output_depth() const { return output_channels / groups; }
  int taps() const { return kernel_size * kernel_size; }
  int64_t output_pixels() const { return int64_t{batch} * output_height * output_width; }
  Shape output_shape() const { return {batch, output_height, output_width, output_channels}; }
};

constexpr int64_t ceiling(int64_t a, int64_t b) {
  return (a + b - 1) / b;
}

enum class BiasKind { None = 0, Tied = 1, Untied = 2 };

/// The kernels of conv2d outside any tape (conv2d_launch.cpp, conv2d_gradient_launch.cpp); shapes as there. Every
/// target is written in full.
/// output = leaky_relu(input * weight + bias)
void conv2d_forward(const Conv2dGeometry& geometry, const Tensor& input, const Tensor& weight, const Tensor& bias,
                    BiasKind kind, double negative_slope, const Tensor& output);
/// From here on `gradient` is that of the value before the activation.
void conv2d_backward_input(const Conv2dGeometry& geometry, const Tensor& gradient, const Tensor& weight,
                           const Tensor& input_gradient);
void conv2d_backward_weight(const Conv2dGeometry& geometry, const Tensor& input, const Tensor& gradient,
                            const Tensor& weight_gradient);
void conv2d_backward_bias(const Conv2dGeometry& geometry, BiasKind kind, const Tensor& gradient,
                          const Tensor& bias_gradient);
/// pre_activation = gradient of the value before the leaky ReLU, told from the sign of its output; may be `gradient`.
void conv2d_backward_activation(const Tensor& gradient, const Tensor& output, double negative_slope,
                                const Tensor& pre_activation);

}  // namespace degas
