// What the gather kernels of convolutions (conv2d.cl, conv2d_rows.cl, conv2d_winograd.cl) and the packing of their
// weights share.
// -D VECTORS: vectors of V channels an item holds for each target pixel: together a panel.
// -D STREAM: 1 where the target is too large for the caches and its channels are whole vectors.
#include "common/prefetch.cl"
#include "common/real.cl"
#include "common/tail.cl"

#ifndef STREAM
#define STREAM 0
#endif

#define PANEL (VECTORS * V)

typedef struct {
  int y, x;
} Pair;

typedef struct {
  int source_height, source_width, source_channels;  // channels of all groups
  int target_height, target_width, target_channels;  // folded, as is what follows
  int batch, groups;
  Pair kernel_size, source_step, target_step, lead;
  int group_stride, panel_stride, tap_stride, row_stride;  // of weight, in elements
  int fold;            // target pixels taken as one
  int tile_axis;       // 0 or 1: of the launch, where neighbouring items are tiles; the other one's are panels
  int tiles_per_item;  // an item walks over this many tiles of PIXELS pixels
  int bias_kind;       // 0 none, 1 per channel, 2 per target position and channel
} Gather;

// What a panel's sums start with: the bias per channel, repeated for the pixels of a fold, or zeros.
inline void start_sums(REALV start[VECTORS], global const REAL* bias, const int group, const int panel,
                       const Gather s) {
  const int lanes = s.target_channels / s.groups - panel * PANEL, depth = s.target_channels / s.groups / s.fold;
#pragma unroll
  for (int v = 0; v < VECTORS; ++v) {
    start[v] = 0;
    if (s.bias_kind == 1 && v * V < lanes) {
      global const REAL* from = bias + group * depth;
      if (s.fold == 1) {
        start[v] = load_tail(from + panel * PANEL + v * V, lanes - v * V);
      } else {
        REAL lane[V];
        for (int i = 0; i < V; ++i) lane[i] = from[(panel * PANEL + v * V + i) % depth];
        start[v] = LOAD_VECTOR(0, lane);
      }
    }
  }
}

// One pixel's `lanes` channels (more stand for all of the panel), with an untied bias if there is one, and activation.
inline void finish_pixel(const REALV sum[VECTORS], global const REAL* bias, const bool has_bias, global REAL* target,
                         const int lanes, const REAL negative_slope) {
  // No break in loops over sums: these stay in registers only if every loop unrolls in full.
#pragma unroll
  for (int v = 0; v < VECTORS; ++v) {
    if (v * V < lanes) {
      REALV value = sum[v];
      if (has_bias) value += load_tail(bias + v * V, lanes - v * V);
      value = value > 0 ? value : value * negative_slope;
#ifdef STREAM_VECTOR
      STREAM_VECTOR(value, target + v * V);
#else
      store_tail(value, target + v * V, lanes - v * V);
#endif
    }
  }
}
