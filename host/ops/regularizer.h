#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// Mean Euclidean length of the rows of vectors (N,3): shape (1). A row of length 0 has gradient 0.
Tensor mean_length(Tape& tape, const Tensor& vectors);

/// L_s of the method: the mean of s = exp(log_scales) over the entries with s > limit * exp(base_log_scales); 0 when
/// there are none. Equal sizes; shape (1). The gradient goes to log_scales.
Tensor excess_scale(Tape& tape, const Tensor& log_scales, const Tensor& base_log_scales, double limit);

/// Mean over the elements of how far each lies below least + base: max(0, least + base - value); base of equal size, or
/// undefined for 0; shape (1). Below, the gradient is the same however far: nothing is too far to come back.
Tensor mean_shortfall(Tape& tape, const Tensor& values, double least, const Tensor& base = {});

/// value where control <= limit, else 0 without a gradient; both of shape (1). Decided on the device; control gets no
/// gradient from here.
Tensor gate(Tape& tape, const Tensor& value, const Tensor& control, double limit);

}  // namespace degas
