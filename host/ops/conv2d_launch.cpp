#include "host/ops/conv2d_launch.h"

#include <algorithm>
#include <iterator>

namespace degas {
namespace {

// The argument structs mirror those of kernels/conv2d.cl.
struct Pair {
  int y, x;
};

struct GatherArguments {
  int source_height, source_width, source_channels;
  int target_height, target_width, target_channels;
  int batch, groups;
  Pair kernel_size, source_step, target_step, lead;
  int group_stride = 0, panel_stride = 0, tap_stride = 0, row_stride = 0;
  int tile_axis = 1, tiles_per_item = 1;
  int bias_kind = 0;
};

struct PackingArguments {
  int kernel_size, rows, columns;
  int transpose, fold = 1;
  int first_tap = 0, tap_step = 1, fold_step = 0;
};

int floored(int a, int b) {
  return a >= 0 ? a / b : -static_cast<int>(ceiling(-a, b));
}

/// Register block of the gather kernel for so many channels per group.
struct GatherBlock {
  int pixels, vectors, panel;
};

GatherBlock gather_block(const Device& device, int depth) {
  if (!device.is_wide()) return {8, 1, 1};
  // Up to sixteen sums fit; the fewest idle lanes win, and of equal ones the block with the fewest loads.
  constexpr GatherBlock blocks[] = {{4, 4, 64}, {4, 3, 48}, {6, 2, 32}, {8, 1, 16}};
  return *std::min_element(std::begin(blocks), std::end(blocks), [&](const GatherBlock& a, const GatherBlock& b) {
    const auto cost = [&](const GatherBlock& block) {
      return static_cast<double>(ceiling(depth, block.panel) * block.panel) * (block.vectors == 1 ? 1.1 : 1);
    };
    return cost(a) < cost(b);
  });
}

/// The same convolution with `fold` neighbouring target pixels of a line as one.
GatherArguments folded(GatherArguments a, int fold) {
  const int source_step = a.source_step.x, target_step = a.target_step.x, lead = a.lead.x;
  const int last_tap = (fold - 1) * source_step + a.kernel_size.x - 1;  // of the last pixel, counted from the first's
  a.target_width /= fold;
  a.target_channels *= fold;
  a.lead.x = -floored(-lead, target_step);
  a.kernel_size.x = floored(lead + last_tap, target_step) - a.lead.x + 1;
  a.source_step.x = fold * source_step / target_step;
  a.target_step.x = 1;
  return a;
}

/// How many pixels to fold so that the fewest vector operations are spent on each; 1: none.
int best_fold(const Device& device, const GatherArguments& a) {
  if (!device.is_wide() || a.groups != 1) return 1;
  const auto cost = [&](const GatherArguments& arguments, int fold) {
    constexpr double start_of_pixel = 8;  // its addresses, bias, activation and store, measured in multiply-adds
    const double taps = static_cast<double>(arguments.kernel_size.x) / arguments.target_step.x *
                        arguments.kernel_size.y / arguments.target_step.y;
    return static_cast<double>(ceiling(arguments.target_channels, device.vector_width())) *
           (taps * arguments.source_channels + start_of_pixel) / fold;
  };
  int best = 1;
  double least = cost(a, 1);
  for (int fold = 2; fold * a.target_channels <= 2 * device.vector_width(); ++fold) {
    if (a.target_width % fold != 0 || fold % a.target_step.x != 0) continue;
    const double with_fold = cost(folded(a, fold), fold);
    if (with_fold >= least) continue;
    least = with_fold;
    best = fold;
  }
  return best;
}

/// A folded pixel's bias.
Tensor repeated(const Tensor& bias, int channels) {
  Device& device = bias.device();
  const Tensor result(device, {channels});
  device.kernel("conv2d", "repeat_bias", {{"PIXELS", 8}, {"VECTORS", 1}})
      .launch({static_cast<size_t>(channels)}, {1}, bias, result, static_cast<int>(bias.size()), channels);
  return result;
}

/// Runs the gather kernel over `weight` (groups,K,K,Cin/groups,Cout/groups), whose rows and columns change roles when
/// `transpose` is set.
void gather(const Tensor& source, const Tensor& weight, Tensor bias, const Tensor& target, double negative_slope,
            GatherArguments arguments, bool transpose) {
  Device& device = source.device();
  PackingArguments packing{arguments.kernel_size.x, static_cast<int>(weight.dim(3)), static_cast<int>(weight.dim(4)),
                           transpose ? 1 : 0};
  packing.fold = best_fold(device, arguments);
  if (packing.fold > 1) {
    packing.tap_step = arguments.target_step.x;
    packing.fold_step = arguments.source_step.x;
    const int lead = arguments.lead.x;
    arguments = folded(arguments, packing.fold);
    packing.first_tap = arguments.lead.x * packing.tap_step - lead;
    if (arguments.bias_kind == static_cast<int>(BiasKind::Tied)) bias = repeated(bias, arguments.target_channels);
  }
  const int depth = arguments.source_channels / arguments.groups;
  const int target_depth = arguments.target_channels / arguments.groups;
  const int taps = arguments.kernel_size.y * arguments.kernel_size.x;
  const GatherBlock block = gather_block(device, target_depth);
  const Defines defines = {{"PIXELS", block.pixels}, {"VECTORS", block.vectors}};
  const int panels = static_cast<int>(ceiling(target_depth, block.panel));

  Tensor packed = weight;
  // A panel of consecutive lines streams better than one cut out of the tensor; small maps do not repay the copy.
  if (transpose || packing.fold > 1 || target_depth % block.panel != 0 ||
      (device.is_wide() && panels > 1 && arguments.target_height * arguments.target_width >= 128)) {
    packed = Tensor(device, {arguments.groups, panels, taps, depth, block.panel});
    // One channel to a panel: panels lie side by side, so that neighbouring items read neighbouring weights.
    const bool side_by_side = block.panel == 1;
    arguments.row_stride = side_by_side ? panels : block.panel;
    arguments.tap_stride = depth * arguments.row_stride;
    arguments.panel_stride = side_by_side ? 1 : taps * arguments.tap_stride;
    arguments.group_stride = taps * depth * panels * block.panel;
    device.kernel("conv2d", "pack_weights", defines)
        .launch({static_cast<size_t>(panels), static_cast<size_t>(taps), static_cast<size_t>(arguments.groups)},
                device.is_wide() ? Range{1, 1, 1} : Range{32, 1, 1}, weight, packed, packing, arguments);
  } else {
    arguments.row_stride = target_depth;
    arguments.tap_stride = depth * target_depth;
    arguments.panel_stride = block.panel;
    arguments.group_stride = taps * arguments.tap_stride;
  }

  const Pair step = arguments.target_step;
  const int64_t phase_pixels =
      int64_t{arguments.batch} * ceiling(arguments.target_height, step.y) * ceiling(arguments.target_width, step.x);
  const int64_t tiles = ceiling(phase_pixels, block.pixels);
  // Enough work in an item to outweigh its start, enough items to keep every core busy.
  arguments.tiles_per_item = device.is_wide() ? static_cast<int>(std::clamp<int64_t>(tiles / 64, 1, 32)) : 1;
  Range global{static_cast<size_t>(panels * arguments.groups),
               static_cast<size_t>(ceiling(tiles, arguments.tiles_per_item)), static_cast<size_t>(step.y * step.x)};
  // A CPU takes items in the order of axis 0: all panels of a tile while its pixels are in cache, or, where the weights
  // are the larger part, all tiles of a panel.
  if (device.is_wide() && weight.size() > source.size()) {
    std::swap(global[0], global[1]);
    arguments.tile_axis = 0;
  }
  const Range local = device.is_wide() ? Range{1, 1, 1} : Range{32, 4, 1};
  device.kernel("conv2d", "gather", defines)
      .launch(global, local, source, packed, bias, device.zeros(depth * device.real_bytes()), target, negative_slope,
              arguments);
}

}  // namespace

void conv2d_forward(const Conv2dGeometry& g, const Tensor& input, const Tensor& weight, const Tensor& bias,
                    BiasKind kind, double negative_slope, const Tensor& output) {
  const GatherArguments a{.source_height = g.height,
                          .source_width = g.width,
                          .source_channels = g.channels,
                          .target_height = g.output_height,
                          .target_width = g.output_width,
                          .target_channels = g.output_channels,
                          .batch = g.batch,
                          .groups = g.groups,
                          .kernel_size = {g.kernel_size, g.kernel_size},
                          .source_step = {g.stride, g.stride},
                          .target_step = {1, 1},
                          .lead = {-g.padding, -g.padding},
                          .bias_kind = static_cast<int>(kind)};
  gather(input, weight, bias, output, negative_slope, a, false);
}

void conv2d_backward_input(const Conv2dGeometry& g, const Tensor& gradient, const Tensor& weight,
                           const Tensor& input_gradient) {
  const int lead = g.padding - (g.kernel_size - 1);
  const GatherArguments a{.source_height = g.output_height,
                          .source_width = g.output_width,
                          .source_channels = g.output_channels,
                          .target_height = g.height,
                          .target_width = g.width,
                          .target_channels = g.channels,
                          .batch = g.batch,
                          .groups = g.groups,
                          .kernel_size = {g.kernel_size, g.kernel_size},
                          .source_step = {1, 1},
                          .target_step = {g.stride, g.stride},
                          .lead = {lead, lead}};
  gather(gradient, weight, Tensor(), input_gradient, 1.0, a, true);
}

}  // namespace degas
