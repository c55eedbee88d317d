#include "host/ops/conv2d_launch.h"

#include "host/ops/conv2d_parameters.h"
#include "host/ops/conv2d_tuning.h"
#include "host/ops/conv2d_winograd.h"

namespace degas {
namespace {

// Mirrors that of kernels/conv2d_packing.cl.
struct PackingArguments {
  int kernel_size, rows, columns;
  int transpose, fold = 1;
  int first_tap = 0, tap_step = 1, fold_step = 0;
};

/// Whether a CPU stores whole vectors of the target past its caches, which pays where it is too large to stay there
/// until it is read: twice as fast where a convolution does little but move numbers, measured.
bool streams_target(const Device& device, const GatherArguments& a) {
  constexpr size_t too_large = size_t{16} << 20;  // bytes
  const int64_t count = int64_t{a.batch} * a.target_height * a.target_width * a.target_channels;
  const bool whole_vectors = a.target_depth() % device.vector_width() == 0 && (a.fold == 1 || a.groups == 1);
  return device.is_wide() && whole_vectors && count * device.real_bytes() >= too_large;
}

/// Runs a gather kernel over `weight` (groups,K,K,Cin/groups,Cout/groups), whose rows and columns change roles when
/// `transpose` is set.
void gather(const Tensor& source, const Tensor& weight, const Tensor& bias, const Tensor& target, double negative_slope,
            GatherArguments arguments, bool transpose, const GatherParameters& parameters) {
  Device& device = source.device();
  PackingArguments packing{arguments.kernel_size.x, static_cast<int>(weight.dim(3)), static_cast<int>(weight.dim(4)),
                           transpose ? 1 : 0};
  packing.fold = parameters.fold;
  if (packing.fold > 1) {
    packing.tap_step = arguments.target_step.x;
    packing.fold_step = arguments.source_step.x;
    const int lead = arguments.lead.x;
    arguments = folded(arguments, packing.fold);
    packing.first_tap = arguments.lead.x * packing.tap_step - lead;
  }
  const int depth = arguments.depth(), target_depth = arguments.target_depth();
  const int taps = arguments.kernel_size.y * arguments.kernel_size.x;
  const int panel = parameters.vectors * device.vector_width();
  const int panels = static_cast<int>(ceiling(target_depth, panel));

  const bool by_winograd = parameters.kernel == Conv2dKernel::Winograd;
  Tensor packed = weight;
  // A panel of consecutive lines streams better than one cut out of the tensor; small maps do not repay the copy.
  if (by_winograd || transpose || packing.fold > 1 || target_depth % panel != 0 ||
      (device.is_wide() && panels > 1 && arguments.target_height * arguments.target_width >= 128)) {
    packed = Tensor(device, {arguments.groups, panels, taps, depth, panel});
    // On GPUs panels lie side by side, so that neighbouring items read neighbouring weights.
    const bool side_by_side = !device.is_wide();
    arguments.row_stride = side_by_side ? panels * panel : panel;
    arguments.tap_stride = depth * arguments.row_stride;
    arguments.panel_stride = side_by_side ? panel : taps * arguments.tap_stride;
    arguments.group_stride = taps * depth * panels * panel;
    device.kernel("conv2d_packing", "pack_weights", {{"VECTORS", parameters.vectors}})
        .launch({static_cast<size_t>(panels), static_cast<size_t>(taps), static_cast<size_t>(arguments.groups)},
                device.is_wide() ? Range{1, 1, 1} : Range{32, 1, 1}, weight, packed, packing, arguments);
  } else {
    arguments.row_stride = target_depth;
    arguments.tap_stride = depth * target_depth;
    arguments.panel_stride = panel;
    arguments.group_stride = taps * arguments.tap_stride;
  }

  const int stream = streams_target(device, arguments);
  if (by_winograd)
    return gather_by_winograd(source, packed, bias, target, negative_slope, arguments, parameters, stream);

  const Tiles tiles = tiles_of(device, arguments, parameters);
  arguments.tiles_per_item = tiles.per_item;
  arguments.tile_axis = parameters.tiles_first ? 0 : 1;
  const auto panel_items = static_cast<size_t>(panels * arguments.groups);
  const auto tile_items = static_cast<size_t>(ceiling(tiles.count, tiles.per_item));
  const auto phases = static_cast<size_t>(arguments.target_step.y * arguments.target_step.x);
  const Range global =
      parameters.tiles_first ? Range{tile_items, panel_items, phases} : Range{panel_items, tile_items, phases};
  const auto [group_panels, group_tiles] = gather_group(device, arguments, parameters);
  const Range local =
      parameters.tiles_first ? Range{group_tiles, group_panels, 1} : Range{group_panels, group_tiles, 1};
  const Kernel kernel =
      parameters.kernel == Conv2dKernel::Rows
          ? device.kernel("conv2d_rows", "gather_rows",
                          {{"PIXELS", parameters.pixels},
                           {"TAPS", arguments.kernel_size.x},
                           {"STEP", arguments.source_step.x},
                           {"SOURCE_CHANNELS", arguments.source_channels},
                           {"STREAM", stream},
                           {"HALVES", parameters.fold > 1 && arguments.groups > 1 ? 1 : 0},
                           {"HALF_V", device.vector_width() / 2}})
          : device.kernel("conv2d", "gather",
                          {{"PIXELS", parameters.pixels}, {"VECTORS", parameters.vectors}, {"STREAM", stream}});
  kernel.launch(global, local, source, packed, bias, device.zeros(depth * device.real_bytes()), target, negative_slope,
                arguments);
}

/// The same with the device's parameters.
void gather(const Tensor& source, const Tensor& weight, const Tensor& bias, const Tensor& target, double negative_slope,
            const GatherArguments& arguments, bool transpose) {
  const GatherParameters parameters = tuned_gather_parameters(
      source.device(), arguments, weight.shape(),
      [=](const Tensor& source, const Tensor& weight, const Tensor& target, const GatherParameters& candidate) {
        GatherArguments without_bias = arguments;
        without_bias.bias_kind = static_cast<int>(BiasKind::None);
        gather(source, weight, Tensor(), target, 1, without_bias, transpose, candidate);
      });
  gather(source, weight, bias, target, negative_slope, arguments, transpose, parameters);
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
