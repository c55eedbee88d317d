// 2-D convolution in gather form, NHWC, grouped: the forward pass and, with flipped and transposed weights, the gradient
// with respect to the input. Every target value is one item's sum in a fixed order: deterministic, no atomics.
//
//   target(n, y, x, g, c) = sum over ky, kx, k of source(n, (y * source_step + lead + ky) / target_step, same for x, g, k)
//                           * weight(g, ky, kx, k, c)
//
// over the taps for which the division leaves no remainder and the source pixel exists. One of the steps is 1:
// forward has source_step = stride and lead = -padding; the input's gradient has target_step = stride and
// lead = padding - (kernel - 1). Target pixels of equal (y mod target_step, x mod target_step), a "phase", use the same
// taps, so an item works within one phase.
//
// weight: panels (groups, panels, kernel, kernel, source channels / group, panel) with zeros behind the last channel, as
// pack_weights makes them, or the plain tensor where panels divide it; the strides say which.
// -D PIXELS: target pixels an item holds in registers. -D VECTORS: vectors of V channels it holds for each.
// Launch gather: (panels * groups, items over the pixels of a phase, phases); local size free, {1, 1, 1} on CPUs.
#include "common/real.cl"

#define PANEL (VECTORS * V)

typedef struct {
  int source_height, source_width, source_channels;  // channels of all groups
  int target_height, target_width, target_channels;
  int batch, groups, kernel_size;
  int source_step, target_step, lead;
  int group_stride, panel_stride, tap_stride, row_stride;  // of weight, in elements
  int tiles_per_item;                                      // an item walks over this many tiles of PIXELS pixels
  int bias_kind;                                           // 0 none, 1 per channel, 2 per target position and channel
} Gather;

inline REALV load_lanes(global const REAL* from, int lanes) {
#if V == 1
  return from[0];
#else
  if (lanes >= V) return LOAD_VECTOR(0, from);
  REAL values[V];
  for (int lane = 0; lane < V; ++lane) values[lane] = lane < lanes ? from[lane] : (REAL)0;
  return LOAD_VECTOR(0, values);
#endif
}

inline void store_lanes(REALV value, global REAL* to, int lanes) {
#if V == 1
  to[0] = value;
#else
  if (lanes >= V) {
    STORE_VECTOR(value, 0, to);
    return;
  }
  REAL values[V];
  STORE_VECTOR(value, 0, values);
  for (int lane = 0; lane < lanes; ++lane) to[lane] = values[lane];
#endif
}

// zeros: kernel * source channels / group of them, read in place of pixels outside the source.
kernel void gather(global const REAL* source, global const REAL* weight, global const REAL* bias,
                   global const REAL* zeros, global REAL* target, const REAL negative_slope, const Gather s) {
  const int source_depth = s.source_channels / s.groups, target_depth = s.target_channels / s.groups;
  const int panels = (target_depth + PANEL - 1) / PANEL;
  const int group = (int)get_global_id(0) / panels, panel = (int)get_global_id(0) % panels;
  const int phase_y = (int)get_global_id(2) / s.target_step, phase_x = (int)get_global_id(2) % s.target_step;
  const int height = (s.target_height - phase_y + s.target_step - 1) / s.target_step;
  const int width = (s.target_width - phase_x + s.target_step - 1) / s.target_step;
  const int count = s.batch * height * width;
  if (group >= s.groups || phase_y >= s.target_step) return;

  // First tap of the phase on each axis, and the source position it reads at lattice position 0.
  const int tap_y = (s.kernel_size * s.target_step - phase_y - s.lead) % s.target_step;
  const int tap_x = (s.kernel_size * s.target_step - phase_x - s.lead) % s.target_step;
  const int top = (phase_y + s.lead + tap_y) / s.target_step, left = (phase_x + s.lead + tap_x) / s.target_step;
  const int taps_x = (s.kernel_size - tap_x + s.target_step - 1) / s.target_step;

  const int channel = group * target_depth + panel * PANEL;
  const int lanes = target_depth - panel * PANEL;
  global const REAL* const weights = weight + (long)group * s.group_stride + (long)panel * s.panel_stride;

  const int begin = (int)get_global_id(1) * s.tiles_per_item * PIXELS;
  const int end = min(count, begin + s.tiles_per_item * PIXELS);
  for (int tile = begin; tile < end; tile += PIXELS) {
    int y[PIXELS], x[PIXELS];
    global const REAL* image[PIXELS];
    int smallest_x = s.source_width, largest_x = -s.kernel_size;
#pragma unroll
    for (int p = 0; p < PIXELS; ++p) {
      const int pixel = min(tile + p, count - 1);
      const int row = pixel / width;
      y[p] = row % height * s.source_step + top;
      x[p] = pixel % width * s.source_step + left;
      image[p] = source + (long)(row / height) * s.source_height * s.source_width * s.source_channels + group * source_depth;
      smallest_x = min(smallest_x, x[p]);
      largest_x = max(largest_x, x[p]);
    }
    // Without groups a kernel row's taps lie side by side in source and weight: one long run where no tap is outside.
    const bool merged = s.groups == 1 && s.target_step == 1 && smallest_x >= 0 && largest_x + s.kernel_size <= s.source_width;
    const int columns = merged ? 1 : taps_x, run = merged ? s.kernel_size * source_depth : source_depth;

    REALV sum[PIXELS][VECTORS];
#pragma unroll
    for (int p = 0; p < PIXELS; ++p) {
#pragma unroll
      for (int v = 0; v < VECTORS; ++v) sum[p][v] = 0;
    }
    for (int ky = tap_y, ty = 0; ky < s.kernel_size; ky += s.target_step, ++ty) {
      for (int tx = 0; tx < columns; ++tx) {
        global const REAL* values[PIXELS];
#pragma unroll
        for (int p = 0; p < PIXELS; ++p) {
          const int sy = y[p] + ty, sx = x[p] + tx;
          const bool inside = sy >= 0 && sy < s.source_height && sx >= 0 && sx < s.source_width;
          values[p] = inside ? image[p] + ((long)sy * s.source_width + sx) * s.source_channels : zeros;
        }
        global const REAL* w = weights + (long)(ky * s.kernel_size + tap_x + tx * s.target_step) * s.tap_stride;
        for (int k = 0; k < run; ++k, w += s.row_stride) {
          REALV factor[VECTORS];
#pragma unroll
          for (int v = 0; v < VECTORS; ++v) factor[v] = LOAD_VECTOR(v, w);
#pragma unroll
          for (int p = 0; p < PIXELS; ++p) {
#pragma unroll
            for (int v = 0; v < VECTORS; ++v) sum[p][v] = fma((REALV)(values[p][k]), factor[v], sum[p][v]);
          }
        }
      }
    }

#pragma unroll
    for (int p = 0; p < PIXELS; ++p) {
      if (tile + p >= end) break;
      const int row = (tile + p) / width;
      const int target_y = row % height * s.target_step + phase_y;
      const int target_x = (tile + p) % width * s.target_step + phase_x;
      const long position = (long)target_y * s.target_width + target_x;
      const long pixel = (long)(row / height) * s.target_height * s.target_width + position;
#pragma unroll
      for (int v = 0; v < VECTORS; ++v) {
        if (v * V >= lanes) break;
        const int c = channel + v * V;
        REALV value = sum[p][v];
        if (s.bias_kind == 1) value += load_lanes(bias + c, lanes - v * V);
        if (s.bias_kind == 2) value += load_lanes(bias + position * s.target_channels + c, lanes - v * V);
        value = value > 0 ? value : value * negative_slope;
        store_lanes(value, target + pixel * s.target_channels + c, lanes - v * V);
      }
    }
  }
}

// panels from weight (groups, kernel, kernel, rows, columns). transpose = 0: rows stay rows. transpose = 1: for the
// input's gradient, rows and columns change places and the taps are turned by 180 degrees.
// Launch: one item per vector of the panels; local size free.
kernel void pack_weights(global const REAL* weight, global REAL* panels, const int groups, const int taps, const int rows,
                         const int columns, const int transpose) {
  const int panel_count = ((transpose ? rows : columns) + PANEL - 1) / PANEL;
  const int depth = transpose ? columns : rows, width = transpose ? rows : columns;
  const long i = get_global_id(0);
  if (i >= (long)groups * panel_count * taps * depth * VECTORS) return;
  const int v = i % VECTORS;
  const int k = i / VECTORS % depth;
  const int tap = i / VECTORS / depth % taps;
  const int panel = i / VECTORS / depth / taps % panel_count;
  const int group = i / VECTORS / depth / taps / panel_count;
  const int first = panel * PANEL + v * V;
  const int from_tap = transpose ? taps - 1 - tap : tap;
  global const REAL* from = weight + (long)(group * taps + from_tap) * rows * columns +
                            (transpose ? k + (long)first * columns : (long)k * columns + first);
  const int step = transpose ? columns : 1;
  for (int lane = 0; lane < V; ++lane) panels[i * V + lane] = first + lane < width ? from[(long)lane * step] : (REAL)0;
}
