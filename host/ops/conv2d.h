#pragma once

#include <span>

#include "host/autograd/tape.h"

namespace degas {

struct Conv2dOptions {
  int stride = 1;
  int padding = 0;            ///< pixels of zeros on each side
  int groups = 1;             ///< channels are cut into this many contiguous groups, each convolved on its own
  double negative_slope = 1;  ///< leaky ReLU applied after the bias, 0 .. 1; 1: none
  /// The way back keeps the output's signs instead of the output: saves memory where no other operator keeps it.
  bool keep_signs = false;
};

/// output = leaky_relu(input * weight + bias), a cross-correlation as in the other libraries.
/// input (N, H, W, Cin); weight (groups, K, K, Cin / groups, Cout / groups); bias undefined, tied (Cout) or untied
/// (OutH, OutW, Cout); output (N, OutH, OutW, Cout) with OutH = (H + 2 padding - K) / stride + 1.
/// Gradients for input, weight and bias. Shapes that do not fit throw std::logic_error.
Tensor conv2d(Tape& tape, const Tensor& input, const Tensor& weight, const Tensor& bias, const Conv2dOptions& options);

/// torch's (Cout,Cin,K,K) times `factor` in conv2d's layout, (1,K,K,Cin,Cout). std::logic_error for another shape.
Tensor conv2d_weight_from_torch(Device& device, const Shape& shape, std::span<const float> values, double factor = 1);

}  // namespace degas
