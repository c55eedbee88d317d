#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// a + b, elementwise; equal sizes.
Tensor add(Tape& tape, const Tensor& a, const Tensor& b);
/// a * b, elementwise; equal sizes.
Tensor multiply(Tape& tape, const Tensor& a, const Tensor& b);
/// factor * input + offset.
Tensor scale(Tape& tape, const Tensor& input, double factor, double offset = 0);

/// array *= factor, which has one element; outside any tape.
void scale_in_place(const Tensor& array, const Tensor& factor);

}  // namespace degas
