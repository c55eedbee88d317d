#include "host/ops/conv2d_launch.h"

#include <algorithm>

namespace degas {
namespace {

// The two argument structs mirror those of kernels/conv2d.cl and kernels/conv2d_gradient.cl.
struct GatherArguments {
  int source_height, source_width, source_channels;
  int target_height, target_width, target_channels;
  int batch, groups, kernel_size;
  int source_step, target_step, lead;
  int group_stride = 0, panel_stride = 0, tap_stride = 0, row_stride = 0;
  int tiles_per_item = 1;
  int bias_kind = 0;
};

struct WeightGradientArguments {
  int batch, height, width, channels;
  int output_height, output_width, output_channels;
  int groups, kernel_size, stride, padding;
  int units_per_item, rows_per_split, rows_per_pass;
};

int64_t ceiling(int64_t a, int64_t b) {
  return (a + b - 1) / b;
}

/// Register block of the gather kernel for so many channels per group.
struct GatherBlock {
  int pixels, vectors, panel;
};

GatherBlock gather_block(const Device& device, int depth) {
  if (!device.is_wide()) return {8, 1, 1};
  return depth <= device.vector_width() ? GatherBlock{8, 1, 16} : GatherBlock{6, 2, 32};
}

/// Runs the gather kernel over `weight` (groups,K,K,Cin/groups,Cout/groups), whose rows and columns change roles when
/// `transpose` is set.
void gather(const Tensor& source, const Tensor& weight, const Tensor& bias, const Tensor& target, double negative_slope,
            GatherArguments arguments, bool transpose) {
  Device& device = source.device();
  const int rows = static_cast<int>(weight.dim(3)), columns = static_cast<int>(weight.dim(4));
  const int depth = transpose ? columns : rows, target_depth = transpose ? rows : columns;
  const int taps = arguments.kernel_size * arguments.kernel_size;
  const GatherBlock block = gather_block(device, target_depth);
  const Defines defines = {{"PIXELS", block.pixels}, {"VECTORS", block.vectors}};
  const int panels = static_cast<int>(ceiling(target_depth, block.panel));

  Tensor packed = weight;
  // A panel of consecutive lines streams better than one cut out of the tensor; small maps do not repay the copy.
  const bool many_pixels = int64_t{arguments.target_height} * arguments.target_width >= 512;
  if (transpose || target_depth % block.panel != 0 || (device.is_wide() && panels > 1 && many_pixels)) {
    packed = Tensor(device, {arguments.groups, panels, taps, depth, block.panel});
    // One channel to a panel: panels lie side by side, so that neighbouring items read neighbouring weights.
    const bool side_by_side = block.panel == 1;
    arguments.row_stride = side_by_side ? panels : block.panel;
    arguments.tap_stride = depth * arguments.row_stride;
    arguments.panel_stride = side_by_side ? 1 : taps * arguments.tap_stride;
    arguments.group_stride = taps * depth * panels * block.panel;
    device.kernel("conv2d", "pack_weights", defines)
        .launch({static_cast<size_t>(panels), static_cast<size_t>(taps), static_cast<size_t>(arguments.groups)},
                device.is_wide() ? Range{1, 1, 1} : Range{32, 1, 1}, weight, packed, arguments.groups, taps, rows,
                columns, transpose ? 1 : 0, arguments.group_stride, arguments.panel_stride, arguments.tap_stride,
                arguments.row_stride);
  } else {
    arguments.row_stride = target_depth;
    arguments.tap_stride = depth * target_depth;
    arguments.panel_stride = block.panel;
    arguments.group_stride = taps * arguments.tap_stride;
  }

  const int step = arguments.target_step;
  const int64_t phase_pixels =
      int64_t{arguments.batch} * ceiling(arguments.target_height, step) * ceiling(arguments.target_width, step);
  const int64_t tiles = ceiling(phase_pixels, block.pixels);
  // Enough work in an item to outweigh its start, enough items to keep every core busy.
  arguments.tiles_per_item = device.is_wide() ? static_cast<int>(std::clamp<int64_t>(tiles / 64, 1, 32)) : 1;
  const Tensor zeros = Tensor::zeros(device, {int64_t{depth}});
  const Range local = device.is_wide() ? Range{1, 1, 1} : Range{32, 4, 1};
  device.kernel("conv2d", "gather", defines)
      .launch({static_cast<size_t>(panels * arguments.groups),
               static_cast<size_t>(ceiling(tiles, arguments.tiles_per_item)), static_cast<size_t>(step * step)},
              local, source, packed, bias, zeros, target, negative_slope, arguments);
}

/// Input channels that conv2d_gradient.cl holds in registers.
constexpr int gradient_rows = 8;

Kernel gradient_kernel(Device& device, const char* name, int vectors) {
  return device.kernel("conv2d_gradient", name, {{"ROWS", gradient_rows}, {"VECTORS", vectors}});
}

void sum_splits(const Tensor& partial, const Tensor& output, int splits) {
  Device& device = output.device();
  gradient_kernel(device, "sum_splits", device.is_wide() ? 2 : 1)
      .launch({static_cast<size_t>(output.size())}, device.pointwise_local(), partial, output, splits, output.size());
}

}  // namespace

void conv2d_forward(const Conv2dGeometry& g, const Tensor& input, const Tensor& weight, const Tensor& bias,
                    BiasKind kind, double negative_slope, const Tensor& output) {
  GatherArguments a{g.height,       g.width,           g.channels, g.output_height,
                    g.output_width, g.output_channels, g.batch,    g.groups,
                    g.kernel_size,  g.stride,          1,          -g.padding};
  a.bias_kind = static_cast<int>(kind);
  gather(input, weight, bias, output, negative_slope, a, false);
}

void conv2d_backward_input(const Conv2dGeometry& g, const Tensor& gradient, const Tensor& weight,
                           const Tensor& input_gradient) {
  const GatherArguments a{
      g.output_height, g.output_width, g.output_channels, g.height, g.width,  g.channels,
      g.batch,         g.groups,       g.kernel_size,     1,        g.stride, g.padding - (g.kernel_size - 1)};
  gather(gradient, weight, Tensor(), input_gradient, 1.0, a, true);
}

void conv2d_backward_weight(const Conv2dGeometry& g, const Tensor& input, const Tensor& gradient,
                            const Tensor& weight_gradient) {
  Device& device = input.device();
  const int vectors = device.is_wide() && g.output_depth() > device.vector_width() ? 2 : 1,
            panel = vectors * device.vector_width();
  const int panels = static_cast<int>(ceiling(g.output_depth(), panel)) * g.groups;
  const int units = g.taps() * static_cast<int>(ceiling(g.depth(), gradient_rows));
  const int output_rows = g.batch * g.output_height;

  WeightGradientArguments a{g.batch,           g.height, g.width,       g.channels, g.output_height, g.output_width,
                            g.output_channels, g.groups, g.kernel_size, g.stride,   g.padding,       units,
                            output_rows,       1};
  a.rows_per_pass = static_cast<int>(std::clamp<int64_t>(128 / g.output_width, 1, output_rows));
  const int64_t passes = ceiling(output_rows, a.rows_per_pass);
  const int64_t wanted_splits = device.is_wide() ? ceiling(16, panels) : 32;
  a.rows_per_split = static_cast<int>(ceiling(passes, std::min(passes, wanted_splits))) * a.rows_per_pass;
  const int splits = static_cast<int>(ceiling(output_rows, a.rows_per_split));
  if (!device.is_wide()) {
    a.units_per_item = 1;
  } else if (panels * splits < 16) {
    a.units_per_item = static_cast<int>(ceiling(units, ceiling(16, panels * splits)));
  }

  Tensor padded = gradient;
  const size_t needed = gradient.bytes() + (panel - 1) * device.real_bytes();
  if (g.output_depth() % panel != 0 && gradient.memory().bytes() < needed) {
    padded = Tensor(device, {gradient.size() + panel});
    device.copy(gradient.memory(), padded.memory(), gradient.bytes());
  }
  Shape partial_shape = weight_gradient.shape();
  partial_shape.insert(partial_shape.begin(), splits);
  const Tensor partial = splits == 1 ? weight_gradient : Tensor(device, partial_shape);
  gradient_kernel(device, "weight_gradient", vectors)
      .launch({static_cast<size_t>(panels), static_cast<size_t>(ceiling(units, a.units_per_item)),
               static_cast<size_t>(splits)},
              device.is_wide() ? Range{1, 1, 1} : Range{64, 1, 1}, input, padded, partial, a);
  if (splits > 1) sum_splits(partial, weight_gradient, splits);
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
