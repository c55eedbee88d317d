// 2-D convolution in gather form, NHWC, grouped: the forward pass and, with flipped and transposed weights, the
// gradient with respect to the input. Every target value is one item's sum in a fixed order: deterministic, no atomics.
//
//   target(n, y, x, g, c) = sum over ky, kx, k of weight(g, ky, kx, k, c) *
//                           source(n, (y * source_step + lead + ky) / target_step, same for x, g, k)
//
// over the taps for which the division leaves no remainder and the source pixel exists. One of the steps is 1:
// forward has source_step = stride and lead = -padding; the input's gradient has target_step = stride and
// lead = padding - (kernel - 1). Target pixels of equal (y mod target_step, x mod target_step), a "phase", use the same
// taps, so an item works within one phase.
//
// weight: panels (groups, panels, kernel, kernel, source channels / group, panel) with zeros behind the last channel,
// as pack_weights makes them, or the plain tensor where panels divide it; the strides say which. Where a panel is one
// channel wide (GPUs), pack_weights makes a plain tensor too, so that neighbouring items read neighbouring weights.
// -D PIXELS: target pixels an item holds in registers. -D VECTORS: vectors of V channels it holds for each.
// Launch gather: (panels * groups, items over the pixels of a phase, phases); local size free, {1, 1, 1} on CPUs.
#include "common/prefetch.cl"
#include "common/real.cl"

#define PANEL (VECTORS * V)

#define TILES_AHEAD 2  // distance of prefetches

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
  const int taps_y = (s.kernel_size - tap_y + s.target_step - 1) / s.target_step;
  const int taps_x = (s.kernel_size - tap_x + s.target_step - 1) / s.target_step;

  const int channel = group * target_depth + panel * PANEL;
  const int lanes = target_depth - panel * PANEL;
  global const REAL* const weights = weight + (long)group * s.group_stride + (long)panel * s.panel_stride;

  const int begin = (int)get_global_id(1) * s.tiles_per_item * PIXELS;
  const int end = min(count, begin + s.tiles_per_item * PIXELS);
  // Lattice position of the next pixel; pixels are walked in memory order, so only the start needs divisions.
  int column = begin % width, line = begin / width % height, image = begin / width / height;
  for (int tile = begin; tile < end; tile += PIXELS) {
    int y[PIXELS], x[PIXELS], picture[PIXELS], position[PIXELS];
    global const REAL* corner[PIXELS];  // where the first tap reads, if it is inside
    int smallest_x = s.source_width, largest_x = -s.kernel_size;
    int smallest_y = s.source_height, largest_y = -s.kernel_size;
#pragma unroll
    for (int p = 0; p < PIXELS; ++p) {
      y[p] = line * s.source_step + top;
      x[p] = column * s.source_step + left;
      picture[p] = image;
      position[p] = (line * s.target_step + phase_y) * s.target_width + column * s.target_step + phase_x;
      corner[p] = source + group * source_depth +
                  (((long)image * s.source_height + y[p]) * s.source_width + x[p]) * s.source_channels;
      smallest_x = min(smallest_x, x[p]);
      largest_x = max(largest_x, x[p]);
      smallest_y = min(smallest_y, y[p]);
      largest_y = max(largest_y, y[p]);
      // Pixels behind the last one repeat it; they are not stored.
      if (tile + p + 1 < count) {
        const bool next_line = column + 1 == width, next_image = next_line && line + 1 == height;
        column = next_line ? 0 : column + 1;
        line = next_image ? 0 : line + next_line;
        image += next_image;
      }
    }
    const bool inside_x = smallest_x >= 0 && largest_x + taps_x <= s.source_width;
    const bool all_inside = inside_x && smallest_y >= 0 && largest_y + taps_y <= s.source_height;
    // Without groups a kernel row's taps lie side by side in source and weight: one long run where no tap is outside.
    const bool merged = s.groups == 1 && s.target_step == 1 && inside_x;
    const int columns = merged ? 1 : taps_x, run = merged ? s.kernel_size * source_depth : source_depth;

    // What this tile's end and a later tile's last kernel row will need.
    const int columns_ahead = TILES_AHEAD * PIXELS * s.source_step + taps_x - 1;
    const long ahead = ((long)(taps_y - 1) * s.source_width + columns_ahead) * s.source_channels;
#pragma unroll
    for (int p = 0; p < PIXELS; ++p) {
      for (int k = 0; k < source_depth; k += CACHE_LINE) PREFETCH(corner[p] + ahead + k);
      const long pixel = (long)picture[p] * s.target_height * s.target_width + position[p];
#pragma unroll
      for (int v = 0; v < VECTORS; ++v) {
        if (s.bias_kind == 2) PREFETCH(bias + (long)position[p] * s.target_channels + channel + v * V);
        PREFETCH_WRITE(target + pixel * s.target_channels + channel + v * V);
      }
    }

    REALV sum[PIXELS][VECTORS];
#pragma unroll
    for (int p = 0; p < PIXELS; ++p) {
#pragma unroll
      for (int v = 0; v < VECTORS; ++v) sum[p][v] = 0;
    }
    for (int ty = 0; ty < taps_y; ++ty) {
      for (int tx = 0; tx < columns; ++tx) {
        const long tap = ((long)ty * s.source_width + tx) * s.source_channels;
        global const REAL* values[PIXELS];
#pragma unroll
        for (int p = 0; p < PIXELS; ++p) {
          const int sy = y[p] + ty, sx = x[p] + tx;
          const bool inside = all_inside || (sy >= 0 && sy < s.source_height && sx >= 0 && sx < s.source_width);
          values[p] = inside ? corner[p] + tap : zeros;
        }
        const int weight_tap = (tap_y + ty * s.target_step) * s.kernel_size + tap_x + tx * s.target_step;
        global const REAL* w = weights + (long)weight_tap * s.tap_stride;
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

    // No break in these loops: the sums stay in registers only if they unroll in full.
#pragma unroll
    for (int p = 0; p < PIXELS; ++p) {
      const long pixel = (long)picture[p] * s.target_height * s.target_width + position[p];
#pragma unroll
      for (int v = 0; v < VECTORS; ++v) {
        if (tile + p < end && v * V < lanes) {
          const int c = channel + v * V;
          REALV value = sum[p][v];
          if (s.bias_kind == 1) value += load_lanes(bias + c, lanes - v * V);
          if (s.bias_kind == 2) value += load_lanes(bias + (long)position[p] * s.target_channels + c, lanes - v * V);
          value = value > 0 ? value : value * negative_slope;
          store_lanes(value, target + pixel * s.target_channels + c, lanes - v * V);
        }
      }
    }
  }
}

// panels from weight (groups, kernel, kernel, rows, columns). transpose = 0: rows stay rows. transpose = 1: for the
// input's gradient, rows and columns change places and the taps are turned by 180 degrees. The strides are Gather's.
// Launch: (panels, taps, groups); local size free.
kernel void pack_weights(global const REAL* weight, global REAL* packed, const int groups, const int taps,
                         const int rows, const int columns, const int transpose, const int group_stride,
                         const int panel_stride, const int tap_stride, const int row_stride) {
  const int depth = transpose ? columns : rows, width = transpose ? rows : columns;
  const int panel = get_global_id(0), tap = get_global_id(1), group = get_global_id(2);
  if (panel * PANEL >= width || tap >= taps || group >= groups) return;
  const int from_tap = transpose ? taps - 1 - tap : tap;
  const int row_step = transpose ? 1 : columns, lane_step = transpose ? columns : 1;
  global const REAL* from = weight + (long)(group * taps + from_tap) * rows * columns + (long)panel * PANEL * lane_step;
  global REAL* to = packed + (long)group * group_stride + (long)panel * panel_stride + (long)tap * tap_stride;
  const int lanes = min(PANEL, width - panel * PANEL);
  for (int k = 0; k < depth; ++k) {
    global REAL* line = to + (long)k * row_stride;
    for (int lane = 0; lane < lanes; ++lane) line[lane] = from[(long)k * row_step + (long)lane * lane_step];
    for (int lane = lanes; lane < PANEL; ++lane) line[lane] = 0;
  }
}
