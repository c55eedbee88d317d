#pragma once

#include <array>

#include "host/ops/conv2d_launch.h"

namespace degas {

/// One run of a gather kernel; mirrors the struct of kernels/common/gather.cl.
struct GatherArguments {
  struct Pair {
    int y, x;
  };
  int source_height, source_width, source_channels;
  int target_height, target_width, target_channels;
  int batch, groups;
  Pair kernel_size, source_step, target_step, lead;
  int group_stride = 0, panel_stride = 0, tap_stride = 0, row_stride = 0;
  int fold = 1;
  int tile_axis = 1, tiles_per_item = 1;
  int bias_kind = 0;

  int depth() const { return source_channels / groups; }
  int target_depth() const { return target_channels / groups; }
};

/// The same convolution with `fold` neighbouring target pixels of a line as one.
GatherArguments folded(GatherArguments arguments, int fold);

/// Sums: conv2d.cl and conv2d_gradient.cl. Rows: conv2d_rows.cl and conv2d_gradient_rows.cl. Winograd:
/// conv2d_winograd.cl and conv2d_gradient_winograd.cl, see conv2d_winograd.h.
enum class Conv2dKernel { Sums, Rows, Winograd };

/// How a gather kernel runs: all that may be chosen freely, told from the sizes and the device.
struct GatherParameters {
  int fold;  ///< neighbouring target pixels of a line taken as one
  Conv2dKernel kernel;
  int pixels, vectors;  ///< register block: target pixels (folded; Winograd: tiles), vectors of channels
  int items;            ///< CPUs: about so many items share the tiles of a panel, an item at most 32 of them
  bool tiles_first;     ///< neighbouring items are tiles of a panel, else panels of a tile

  friend bool operator==(const GatherParameters&, const GatherParameters&) = default;
};

/// The register blocks that cover the pixels of a phase of a convolution that is folded already, and those that an item
/// walks over.
struct Tiles {
  int64_t count;
  int per_item;
};
Tiles tiles_of(const Device& device, const GatherArguments& arguments, const GatherParameters& parameters);

/// arguments: not folded yet.
GatherParameters gather_parameters(const Device& device, const GatherArguments& arguments);
/// Items of a work-group along the panels and along the tiles; arguments: folded already.
std::array<size_t, 2> gather_group(const Device& device, const GatherArguments& arguments,
                                   const GatherParameters& parameters);
/// Every other way that is legal too, the likelier ones first: for the tuner.
std::vector<GatherParameters> gather_candidates(const Device& device, const GatherArguments& arguments);

/// How the gradient with respect to the weights is summed.
struct WeightGradientParameters {
  Conv2dKernel kernel;
  bool vectors_are_outputs;  ///< Rows: vectors hold output channels, else input channels
  int fold;                  ///< Sums: neighbouring output pixels of a line taken as one; else 1
  int vectors;               ///< of channels in registers; Rows: 1
  int items = 16;            ///< CPUs: at least so many where the lines suffice; GPUs: splits
  int pass_pixels = 128;     ///< output pixels (folded) about that are summed in registers; Winograd: of no account

  friend bool operator==(const WeightGradientParameters&, const WeightGradientParameters&) = default;
};

/// ROWS of the two kernels' register blocks.
constexpr int weight_gradient_rows = 8, weight_gradient_rows_by_rows = 4;

WeightGradientParameters weight_gradient_parameters(const Device& device, const Conv2dGeometry& geometry);
std::vector<WeightGradientParameters> weight_gradient_candidates(const Device& device, const Conv2dGeometry& geometry);

}  // namespace degas
