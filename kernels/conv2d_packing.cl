// Packs the weights of a convolution for the gather kernels: panels (groups, panels, kernel, kernel, source channels /
// group, panel) with zeros behind the last channel. Where a panel is one channel wide (GPUs) this is a plain tensor
// too, so that neighbouring items read neighbouring weights.
#include "common/gather.cl"

// to[k * line + lane] = from[k * row_step + lane * lane_step] for k < depth, lane < lanes; one of the steps is 1.
inline void copy_lines(global const REAL* from, const int row_step, const int lane_step, global REAL* to,
                       const int line, const int depth, const int lanes) {
  int whole_depth = 0, whole_lanes = 0;  // copied by vectors
#if V > 1
  whole_lanes = lanes / V * V;
  whole_depth = lane_step == 1 ? depth : depth / V * V;
  for (int lane = 0; lane < whole_lanes; lane += V) {
    if (lane_step == 1) {
      for (int k = 0; k < depth; ++k)
        STORE_VECTOR(LOAD_VECTOR(0, from + (long)k * row_step + lane), 0, to + (long)k * line + lane);
    } else {
      for (int k = 0; k < whole_depth; k += V) {
        REALV block[V];
#pragma unroll
        for (int i = 0; i < V; ++i) block[i] = LOAD_VECTOR(0, from + (long)(lane + i) * lane_step + k);
        // Each round deals the even and odd elements of neighbouring vectors apart; after log2(V) rounds rows have
        // become columns.
#pragma unroll
        for (int round = 1; round < V; round *= 2) {
          REALV next[V];
#pragma unroll
          for (int i = 0; i < V / 2; ++i) {
            next[i] = (REALV)(block[2 * i].even, block[2 * i + 1].even);
            next[i + V / 2] = (REALV)(block[2 * i].odd, block[2 * i + 1].odd);
          }
#pragma unroll
          for (int i = 0; i < V; ++i) block[i] = next[i];
        }
#pragma unroll
        for (int i = 0; i < V; ++i) STORE_VECTOR(block[i], 0, to + (long)(k + i) * line + lane);
      }
    }
  }
#endif
  for (int k = 0; k < depth; ++k) {
    for (int lane = k < whole_depth ? whole_lanes : 0; lane < lanes; ++lane)
      to[(long)k * line + lane] = from[(long)k * row_step + (long)lane * lane_step];
  }
}

typedef struct {
  int kernel_size, rows, columns;  // of weight
  int transpose, fold;
  // Pixel p of a fold has the weight's tap first_tap + x * tap_step - p * fold_step at tap x of the folded kernel.
  int first_tap, tap_step, fold_step;
} Packing;

// panels for Gather `s` from weight (groups, kernel, kernel, rows, columns). transpose = 0: rows stay rows.
// transpose = 1: for the input's gradient, rows and columns change places and the taps are turned by 180 degrees.
// fold > 1: of one panel, the pixels side by side.
// Launch: (panels, taps, groups); local size free.
kernel void pack_weights(global const REAL* weight, global REAL* packed, const Packing pack, const Gather s) {
  const int depth = pack.transpose ? pack.columns : pack.rows, width = pack.transpose ? pack.rows : pack.columns;
  const int panel = get_global_id(0), tap = get_global_id(1), group = get_global_id(2);
  if (panel * PANEL >= width * pack.fold || tap >= s.kernel_size.y * s.kernel_size.x || group >= s.groups) return;
  const int row_step = pack.transpose ? 1 : pack.columns, lane_step = pack.transpose ? pack.columns : 1;
  const int taps = pack.kernel_size * pack.kernel_size, lanes = min(PANEL, width - panel * PANEL);
  global REAL* to = packed + (long)group * s.group_stride + (long)panel * s.panel_stride + (long)tap * s.tap_stride;
  for (int pixel = 0; pixel < pack.fold; ++pixel) {
    const int x = pack.first_tap + tap % s.kernel_size.x * pack.tap_step - pixel * pack.fold_step;
    const bool used = x >= 0 && x < pack.kernel_size;
    const int from_tap = tap / s.kernel_size.x * pack.kernel_size + x;
    global const REAL* from = weight + (long)panel * PANEL * lane_step +
                              (long)(group * taps + (pack.transpose ? taps - 1 - from_tap : from_tap)) * pack.rows *
                                  pack.columns;
    if (used) copy_lines(from, row_step, lane_step, to + pixel * width, s.row_stride, depth, lanes);
    for (int k = 0; k < depth && !used; ++k) {
      for (int lane = 0; lane < lanes; ++lane) to[(long)k * s.row_stride + pixel * width + lane] = 0;
    }
  }
  for (int k = 0; k < depth; ++k) {
    for (int lane = lanes * pack.fold; lane < PANEL; ++lane) to[(long)k * s.row_stride + lane] = 0;
  }
}
