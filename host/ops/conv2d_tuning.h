#pragma once

#include <functional>

#include "host/ops/conv2d_parameters.h"

namespace degas {

/// Source, weight and target of a gather kernel without bias, and how to run it.
using GatherLaunch = std::function<void(const Tensor&, const Tensor&, const Tensor&, const GatherParameters&)>;
/// Input, output's gradient and weight's gradient, and how to run it.
using WeightGradientLaunch =
    std::function<void(const Tensor&, const Tensor&, const Tensor&, const WeightGradientParameters&)>;

/// The built-in parameters, or where the device has a tuner the fastest that it finds, on invented numbers. Maps of
/// about the same size share a choice: a person's box in a picture differs from view to view.
GatherParameters tuned_gather_parameters(Device& device, const GatherArguments& arguments, const Shape& weight,
                                         const GatherLaunch& launch);
WeightGradientParameters tuned_weight_gradient_parameters(Device& device, const Conv2dGeometry& geometry,
                                                          const WeightGradientLaunch& launch);

}  // namespace degas
