#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// Sum of all elements: shape (1).
Tensor sum(Tape& tape, const Tensor& input);
/// Mean of all elements: shape (1).
Tensor mean(Tape& tape, const Tensor& input);

}  // namespace degas
