#include <algorithm>

#include "host/ops/conv2d_launch.h"

namespace degas {
namespace {

// Mirrors that of kernels/conv2d_gradient.cl.
struct WeightGradientArguments {
  int batch, height, width, channels;
  int output_height, output_width, output_channels;
  int groups, kernel_height, kernel_width, stride_y, stride_x, padding;
  int units_per_item, rows_per_split, rows_per_pass;
};

/// Pairs of tap and input channel that conv2d_gradient.cl holds in registers.
constexpr int gradient_rows = 8;

/// How many output pixels to fold so that the weight gradient spends the fewest vector operations on each; 1: none.
int best_gradient_fold(const Device& device, const Conv2dGeometry& g) {
  if (!device.is_wide() || g.groups != 1) return 1;
  const auto cost = [&](int fold) {
    const int pairs = ((fold - 1) * g.stride + g.kernel_size) * g.channels;
    return static_cast<double>(ceiling(fold * g.output_channels, device.vector_width())) *
           ceiling(pairs, gradient_rows) / fold;
  };
  int best = 1;
  for (int fold = 2; fold * g.output_channels <= 2 * device.vector_width(); ++fold) {
    if (g.output_width % fold == 0 && cost(fold) < cost(best)) best = fold;
  }
  return best;
}

Kernel gradient_kernel(Device& device, const char* name, int vectors) {
  return device.kernel("conv2d_gradient", name, {{"ROWS", gradient_rows}, {"VECTORS", vectors}});
}

void sum_splits(const Tensor& partial, const Tensor& output, int splits) {
  Device& device = output.device();
  gradient_kernel(device, "sum_splits", device.is_wide() ? 2 : 1)
      .launch({static_cast<size_t>(output.size())}, device.pointwise_local(), partial, output, splits, output.size());
}

}  // namespace

void conv2d_backward_weight(const Conv2dGeometry& g, const Tensor& input, const Tensor& gradient,
                            const Tensor& weight_gradient) {
  Device& device = input.device();
  const int fold = best_gradient_fold(device, g);
  const int kernel_width = (fold - 1) * g.stride + g.kernel_size, output_depth = fold * g.output_depth();
  const int output_width = g.output_width / fold;
  const int vectors = device.is_wide() && output_depth > device.vector_width() ? 2 : 1;
  const int panels = static_cast<int>(ceiling(output_depth, vectors * device.vector_width())) * g.groups;
  const bool merged = g.groups == 1 && g.depth() % gradient_rows != 0;
  const int units = static_cast<int>(merged ? g.kernel_size * ceiling(kernel_width * g.depth(), gradient_rows)
                                            : g.kernel_size * kernel_width * ceiling(g.depth(), gradient_rows));
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
  a.rows_per_pass = static_cast<int>(std::clamp<int64_t>(128 / output_width, 1, output_rows));
  const int64_t passes = ceiling(output_rows, a.rows_per_pass);
  const int64_t wanted_splits = device.is_wide() ? ceiling(16, panels) : 32;
  a.rows_per_split = static_cast<int>(ceiling(passes, std::min(passes, wanted_splits))) * a.rows_per_pass;
  const int splits = static_cast<int>(ceiling(output_rows, a.rows_per_split));
  if (!device.is_wide()) {
    a.units_per_item = 1;
  } else if (panels * splits < 16) {
    a.units_per_item = static_cast<int>(ceiling(units, ceiling(16, panels * splits)));
  }

  const Tensor partial = splits * fold == 1
                             ? weight_gradient
                             : Tensor(device, {splits, g.groups, g.kernel_size, kernel_width, g.depth(), output_depth});
  gradient_kernel(device, "weight_gradient", vectors)
      .launch({static_cast<size_t>(panels), static_cast<size_t>(ceiling(units, a.units_per_item)),
               static_cast<size_t>(splits)},
              device.is_wide() ? Range{1, 1, 1} : Range{64, 1, 1}, input, gradient, partial, a);
  if (fold > 1) {
    gradient_kernel(device, "sum_folds", vectors)
        .launch({static_cast<size_t>(weight_gradient.size())}, device.pointwise_local(), partial, weight_gradient,
                splits, fold, g.kernel_size, g.stride, g.channels, g.output_channels);
  } else if (splits > 1) {
    sum_splits(partial, weight_gradient, splits);
  }
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
