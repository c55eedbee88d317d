#pragma once

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

/// How a gather kernel runs: all that may be chosen freely, told from the sizes and the device.
struct GatherParameters {
  int fold;             ///< neighbouring target pixels of a line taken as one
  bool by_rows;         ///< conv2d_rows.cl, else conv2d.cl
  bool halves;          ///< folded within groups: conv2d_rows.cl's HALVES
  int pixels, vectors;  ///< register block: target pixels (folded), vectors of channels
  int64_t tiles;        ///< register blocks that cover the pixels of a phase
  int tiles_per_item;   ///< those that an item walks over
  bool tiles_first;     ///< neighbouring items are tiles of a panel, else panels of a tile
};

/// arguments: not folded yet.
GatherParameters gather_parameters(const Device& device, const GatherArguments& arguments);

/// How the gradient with respect to the weights is summed.
struct WeightGradientParameters {
  bool by_rows;              ///< conv2d_gradient_rows.cl, else conv2d_gradient.cl
  bool vectors_are_outputs;  ///< by rows: vectors hold output channels, else input channels
  int fold;                  ///< neighbouring output pixels of a line taken as one; by rows: 1
  int vectors;               ///< of channels in registers; by rows: 1
};

/// ROWS of the two kernels' register blocks.
constexpr int weight_gradient_rows = 8, weight_gradient_rows_by_rows = 4;

WeightGradientParameters weight_gradient_parameters(const Device& device, const Conv2dGeometry& geometry);

}  // namespace degas
