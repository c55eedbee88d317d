#pragma once

#include <functional>
#include <vector>

#include "host/autograd/tape.h"

namespace degas {

/// Builds the operator under test from its inputs; the outputs may have any shapes.
using DifferentiableFunction = std::function<std::vector<Tensor>(Tape&, const std::vector<Tensor>&)>;

struct GradientCheckOptions {
  double step = 1e-5;          ///< half the width of the central difference
  int samples_per_input = 64;  ///< elements checked of each input, chosen at random; all when it has fewer
  unsigned seed = 1;
};

/// Central finite differences on a random weighted sum of all outputs against the tape's gradient, for every input
/// that requires one. Returns the largest |numeric - tape| / (1e-3 * largest |numeric| of that input + max(|numeric|,
/// |tape|)) seen. Meant for devices with Real::Double, where 1e-6 is a good bar. Under simulators, some hundred times
/// slower than hardware, DEGAS_GRADIENT_SAMPLES in the environment lowers samples_per_input.
double gradient_check(Device& device, const DifferentiableFunction& function, const std::vector<Tensor>& inputs,
                      const GradientCheckOptions& options = {});

}  // namespace degas
