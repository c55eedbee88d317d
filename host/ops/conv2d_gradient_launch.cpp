#include <algorithm>
#include <bit>

#include "host/ops/conv2d_launch.h"
#include "host/ops/conv2d_parameters.h"
#include "host/ops/conv2d_tuning.h"
#include "host/ops/conv2d_winograd.h"

namespace degas {
namespace {

// Mirrors that of kernels/conv2d_gradient.cl.
struct WeightGradientArguments {
  int batch, height, width, channels;
  int output_height, output_width, output_channels;
  int groups, kernel_height, kernel_width, stride_y, stride_x, padding;
  int units_per_item, rows_per_split, rows_per_pass;
};

// Mirrors that of kernels/conv2d_gradient_rows.cl.
struct RowProductsArguments {
  int batch, groups, kernel_height;
  int value_height, value_width, value_channels;
  int vector_height, vector_width, vector_channels;
  int step, lead;
  int units_per_item, lines_per_split, lines_per_pass;
};

Kernel gradient_kernel(Device& device, const char* name, int vectors) {
  return device.kernel("conv2d_gradient", name, {{"ROWS", weight_gradient_rows}, {"VECTORS", vectors}});
}

void sum_splits(const Tensor& partial, const Tensor& output, int splits) {
  Device& device = output.device();
  gradient_kernel(device, "sum_splits", device.is_wide() ? 2 : 1)
      .launch({static_cast<size_t>(output.size())}, device.pointwise_local(), partial, output, splits, output.size());
}

void backward_weight_by_rows(const Conv2dGeometry& g, const WeightGradientParameters& parameters, const Tensor& input,
                             const Tensor& gradient, const Tensor& weight_gradient) {
  Device& device = input.device();
  const bool vectors_are_outputs = parameters.vectors_are_outputs;
  RowProductsArguments a{};
  a.batch = g.batch;
  a.groups = g.groups;
  a.kernel_height = g.kernel_size;
  a.value_height = vectors_are_outputs ? g.height : g.output_height;
  a.value_width = vectors_are_outputs ? g.width : g.output_width;
  a.value_channels = vectors_are_outputs ? g.channels : g.output_channels;
  a.vector_height = vectors_are_outputs ? g.output_height : g.height;
  a.vector_width = vectors_are_outputs ? g.output_width : g.width;
  a.vector_channels = vectors_are_outputs ? g.output_channels : g.channels;
  a.step = vectors_are_outputs ? 1 : g.stride;
  a.lead = vectors_are_outputs ? g.padding - (g.kernel_size - 1) : -g.padding;
  const int value_depth = a.value_channels / g.groups, lines = g.batch * a.value_height;
  const int panels = static_cast<int>(ceiling(a.vector_channels / g.groups, device.vector_width()));
  const int blocks = static_cast<int>(ceiling(value_depth, weight_gradient_rows_by_rows));
  const int units = g.groups * panels * blocks * g.kernel_size;
  // All units of a line by one item, while the line is in cache; enough items to keep every core busy.
  const int wanted_items = parameters.items;
  a.lines_per_pass = static_cast<int>(std::clamp<int64_t>(parameters.pass_pixels / a.value_width, 1, lines));
  const int64_t passes = ceiling(lines, a.lines_per_pass);
  a.lines_per_split = static_cast<int>(ceiling(passes, std::min<int64_t>(passes, wanted_items))) * a.lines_per_pass;
  const int splits = static_cast<int>(ceiling(lines, a.lines_per_split));
  a.units_per_item = static_cast<int>(ceiling(units, ceiling(wanted_items, splits)));

  const Tensor partial(device,
                       {splits, g.groups, panels, g.kernel_size, g.kernel_size, value_depth, device.vector_width()});
  const auto kernel = [&](const char* name) {
    return device.kernel("conv2d_gradient_rows", name,
                         {{"TAPS", g.kernel_size}, {"ROWS", weight_gradient_rows_by_rows}});
  };
  kernel("weight_gradient_rows")
      .launch({static_cast<size_t>(ceiling(units, a.units_per_item)), static_cast<size_t>(splits)}, {1, 1},
              vectors_are_outputs ? input : gradient, vectors_are_outputs ? gradient : input, partial, a);
  kernel("sum_products")
      .launch({static_cast<size_t>(weight_gradient.size())}, device.pointwise_local(), partial, weight_gradient, splits,
              g.groups, g.taps(), g.depth(), g.output_depth(), vectors_are_outputs ? 1 : 0);
}

void backward_weight(const Conv2dGeometry& g, const WeightGradientParameters& parameters, const Tensor& input,
                     const Tensor& gradient, const Tensor& weight_gradient) {
  if (parameters.kernel == Conv2dKernel::Rows)
    return backward_weight_by_rows(g, parameters, input, gradient, weight_gradient);
  if (parameters.kernel == Conv2dKernel::Winograd)
    return backward_weight_by_winograd(g, parameters, input, gradient, weight_gradient);
  Device& device = input.device();
  const int fold = parameters.fold, vectors = parameters.vectors;
  const int kernel_width = (fold - 1) * g.stride + g.kernel_size, output_depth = fold * g.output_depth();
  const int output_width = g.output_width / fold;
  const int panels = static_cast<int>(ceiling(output_depth, vectors * device.vector_width())) * g.groups;
  const bool merged = g.groups == 1 && g.depth() % weight_gradient_rows != 0;
  const int units = static_cast<int>(merged ? g.kernel_size * ceiling(kernel_width * g.depth(), weight_gradient_rows)
                                            : g.kernel_size * kernel_width * ceiling(g.depth(), weight_gradient_rows));
  const int output_rows = g.batch * g.output_height;

  WeightGradientArguments a{.batch = g.batch,
                            .height = g.height,
                            .width = g.width,
                            .channels = g.channels,
                            .output_height = g.output_height,
                            .output_width = output_width,
                            .output_channels = g.output_channels * fold,
                            .groups = g.groups,
                            .kernel_height = g.kernel_size,
                            .kernel_width = kernel_width,
                            .stride_y = g.stride,
                            .stride_x = g.stride * fold,
                            .padding = g.padding,
                            .units_per_item = units,
                            .rows_per_split = output_rows,
                            .rows_per_pass = 1};
  a.rows_per_pass = static_cast<int>(std::clamp<int64_t>(parameters.pass_pixels / output_width, 1, output_rows));
  const int64_t passes = ceiling(output_rows, a.rows_per_pass);
  const int64_t wanted_splits = device.is_wide() ? ceiling(parameters.items, panels) : parameters.items;
  a.rows_per_split = static_cast<int>(ceiling(passes, std::min(passes, wanted_splits))) * a.rows_per_pass;
  const int splits = static_cast<int>(ceiling(output_rows, a.rows_per_split));
  if (!device.is_wide()) {
    a.units_per_item = 1;
  } else if (panels * splits < parameters.items) {
    a.units_per_item = static_cast<int>(ceiling(units, ceiling(parameters.items, panels * splits)));
  }

  const Tensor partial = splits * fold == 1
                             ? weight_gradient
                             : Tensor(device, {splits, g.groups, g.kernel_size, kernel_width, g.depth(), output_depth});
  // No wider than there are panels, or much of a work-group would idle.
  const size_t group_panels = std::min<size_t>(32, std::bit_ceil(static_cast<size_t>(panels)));
  gradient_kernel(device, "weight_gradient", vectors)
      .launch({static_cast<size_t>(panels), static_cast<size_t>(ceiling(units, a.units_per_item)),
               static_cast<size_t>(splits)},
              device.is_wide() ? Range{1, 1, 1} : Range{group_panels, 64 / group_panels, 1}, input, gradient, partial,
              a);
  if (fold > 1) {
    gradient_kernel(device, "sum_folds", vectors)
        .launch({static_cast<size_t>(weight_gradient.size())}, device.pointwise_local(), partial, weight_gradient,
                splits, fold, g.kernel_size, g.stride, g.channels, g.output_channels);
  } else if (splits > 1) {
    sum_splits(partial, weight_gradient, splits);
  }
}

}  // namespace

void conv2d_backward_weight(const Conv2dGeometry& g, const Tensor& input, const Tensor& gradient,
                            const Tensor& weight_gradient) {
  const auto launch = [=](const Tensor& input, const Tensor& gradient, const Tensor& weight_gradient,
                          const WeightGradientParameters& candidate) {
    backward_weight(g, candidate, input, gradient, weight_gradient);
  };
  launch(input, gradient, weight_gradient, tuned_weight_gradient_parameters(input.device(), g, launch));
}

void conv2d_backward_bias(const Conv2dGeometry& g, BiasKind kind, const Tensor& gradient, const Tensor& bias_gradient) {
  if (kind == BiasKind::Untied) return sum_splits(gradient, bias_gradient, g.batch);
  Device& device = gradient.device();
  const int64_t pixels = g.output_pixels(), per_split = std::max<int64_t>(64, ceiling(pixels, 256));
  const int splits = static_cast<int>(ceiling(pixels, per_split));
  const Tensor partial(device, {splits, g.output_channels});
  gradient_kernel(device, "channel_sums", device.is_wide() ? 2 : 1)
      .launch({static_cast<size_t>(g.output_channels), static_cast<size_t>(splits)}, {1, 1}, gradient, partial,
              g.output_channels, pixels, per_split);
  sum_splits(partial, bias_gradient, splits);
}

void conv2d_backward_activation(const Tensor& gradient, const Tensor& output, double negative_slope,
                                const Tensor& pre_activation) {
  Device& device = output.device();
  gradient_kernel(device, "activation_gradient", device.is_wide() ? 2 : 1)
      .launch(device.pointwise_global(output.size()), device.pointwise_local(), gradient, output, pre_activation,
              negative_slope, output.size());
}

}  // namespace degas
