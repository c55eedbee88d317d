#pragma once

#include "host/ops/conv2d_parameters.h"

namespace degas {

/// Convolutions by Winograd's minimal filtering F(4x4, 3x3), kernels/conv2d_winograd.cl and
/// conv2d_gradient_winograd.cl: a quarter of the multiply-adds of plain sums, for wide layers on CPUs.

/// Whether it may run: 3 x 3 kernels of step 1 and whole vectors of source channels, on CPUs with room for its points
/// in a work-group's memory.
bool winograd_allowed(const Device& device, const GatherArguments& arguments, const GatherParameters& parameters);

/// Its parameters for such a convolution.
GatherParameters winograd_parameters(const Device& device);

/// Whether what it saves is more than its transforms cost, told from the sizes of what is allowed.
bool winograd_pays(const Device& device, const GatherArguments& arguments);

/// One run over the weights of `panels` panels per group as conv2d_packing.cl packs them; shapes and arguments as
/// those of conv2d_forward. stream: see conv2d_launch.cpp.
void gather_by_winograd(const Tensor& source, const Tensor& packed, const Tensor& bias, const Tensor& target,
                        double negative_slope, const GatherArguments& arguments, const GatherParameters& parameters,
                        int stream);

/// The same for the gradient with respect to the weights; whole vectors of output channels too.
bool winograd_gradient_allowed(const Device& device, const Conv2dGeometry& geometry,
                               const WeightGradientParameters& parameters);
WeightGradientParameters winograd_gradient_parameters(const Device& device, const Conv2dGeometry& geometry);
bool winograd_gradient_pays(const Device& device, const Conv2dGeometry& geometry);
/// Shapes as those of conv2d_backward_weight.
void backward_weight_by_winograd(const Conv2dGeometry& geometry, const WeightGradientParameters& parameters,
                                 const Tensor& input, const Tensor& gradient, const Tensor& weight_gradient);

}  // namespace degas
