#pragma once

#include <vector>

#include "host/autograd/tape.h"

namespace degas {

/// A layer's direction v: (groups, .., Cout / groups), of a convolution (groups, K, K, Cin / groups, Cout / groups) or,
/// with groups = 1, of a linear layer (In, Out); and gain: (Cout), the outputs of group 0 first.
struct WeightNormLayer {
  Tensor v, gain;
  int groups = 1;
};

/// Weight normalisation with one norm for the whole tensor: w = gain[o] * v / ||v|| (Salimans and Kingma 2016, as
/// method.md has it), of many layers in few launches. Returns each layer's w in v's shape.
std::vector<Tensor> weight_norm(Tape& tape, const std::vector<WeightNormLayer>& layers);

}  // namespace degas
