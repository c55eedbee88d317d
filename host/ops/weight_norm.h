#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// Weight normalisation with one norm for the whole tensor: w = gain[o] * v / ||v|| (Salimans and Kingma 2016, as
/// method.md has it). v: (groups, .., Cout / groups), of a convolution (groups, K, K, Cin / groups, Cout / groups) or,
/// with groups = 1, of a linear layer (In, Out). gain: (Cout), the outputs of group 0 first. Returns w in v's shape.
Tensor weight_norm(Tape& tape, const Tensor& v, const Tensor& gain, int groups = 1);

}  // namespace degas
