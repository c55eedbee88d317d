#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// leaky_relu(input weight + bias): input (N, In), weight (In, Out), bias (Out) or undefined. negative_slope 1: linear.
/// Made for small N: time is that of reading the weights once a row.
Tensor linear(Tape& tape, const Tensor& input, const Tensor& weight, const Tensor& bias, double negative_slope = 1);

}  // namespace degas
