// 2-D convolution in gather form, NHWC, grouped: the forward pass and, with flipped and transposed weights, the
// gradient with respect to the input. Every target value is one item's sum in a fixed order: deterministic, no atomics.
//
//   target(n, y, x, g, c) = sum over ky, kx, k of weight(g, ky, kx, k, c) *
//                           source(n, (y * source_step.y + lead.y + ky) / target_step.y, same for x, g, k)
//
// over the taps for which the division leaves no remainder and the source pixel exists. One of the steps is 1:
// forward has source_step = stride and lead = -padding; the input's gradient has target_step = stride and
// lead = padding - (kernel - 1). Target pixels of equal (y mod target_step, x mod target_step), a "phase", use the same
// taps, so an item works within one phase.
//
// Narrow layers would leave most of a vector idle. There, `fold` neighbouring pixels of a target line are taken as one
// pixel of fold times the channels (which is how they lie in memory), whose kernel is as wide as all that they read,
// with zeros where a pixel does not use a tap: the same equation with other numbers, and the phases along x are gone.
//
// weight: panels (groups, panels, kernel, kernel, source channels / group, panel) with zeros behind the last channel,
// as pack_weights makes them, or the plain tensor where panels divide it; the strides say which. Where a panel is one
// channel wide (GPUs), pack_weights makes a plain tensor too, so that neighbouring items read neighbouring weights.
// -D PIXELS: target pixels an item holds in registers. -D VECTORS: vectors of V channels it holds for each.
// Launch gather: (panels * groups, items over the pixels of a phase, phases), the first two in either order; local size
// free, {1, 1, 1} on CPUs.
#include "common/prefetch.cl"
#include "common/real.cl"
#include "common/tail.cl"

#define PANEL (VECTORS * V)

#define TILES_AHEAD 2  // distance of prefetches

typedef struct {
  int y, x;
} Pair;

typedef struct {
  int source_height, source_width, source_channels;  // channels of all groups
  int target_height, target_width, target_channels;  // folded, as is what follows
  int batch, groups;
  Pair kernel_size, source_step, target_step, lead;
  int group_stride, panel_stride, tap_stride, row_stride;  // of weight, in elements
  int tile_axis;       // 0 or 1: of the launch, where neighbouring items are tiles; the other one's are panels
  int tiles_per_item;  // an item walks over this many tiles of PIXELS pixels
  int bias_kind;                                           // 0 none, 1 per channel, 2 per target position and channel
} Gather;

// sum[p][v] += corner[p][at + k] * (vector v of line k of w), k = 0 .. run - 1
inline void multiply_add(REALV sum[PIXELS][VECTORS], global const REAL* const corner[PIXELS], const long at,
                         global const REAL* w, const int run, const int row_stride) {
  for (int k = 0; k < run; ++k, w += row_stride) {
    REALV factor[VECTORS];
#pragma unroll
    for (int v = 0; v < VECTORS; ++v) factor[v] = LOAD_VECTOR(v, w);
#pragma unroll
    for (int p = 0; p < PIXELS; ++p) {
#pragma unroll
      for (int v = 0; v < VECTORS; ++v) sum[p][v] = fma((REALV)(corner[p][at + k]), factor[v], sum[p][v]);
    }
  }
}

// One pixel's `lanes` channels (more stand for all of the panel) with bias and activation.
inline void finish_pixel(const REALV sum[VECTORS], global const REAL* bias, const bool has_bias, global REAL* target,
                         const int lanes, const REAL negative_slope) {
  // No break in loops over sums: these stay in registers only if every loop unrolls in full.
#pragma unroll
  for (int v = 0; v < VECTORS; ++v) {
    if (v * V < lanes) {
      REALV value = sum[v];
      if (has_bias) value += load_tail(bias + v * V, lanes - v * V);
      value = value > 0 ? value : value * negative_slope;
      store_tail(value, target + v * V, lanes - v * V);
    }
  }
}

// zeros: at least source channels / group of them, read in place of pixels outside the source.
kernel void gather(global const REAL* source, global const REAL* weight, global const REAL* bias,
                   global const REAL* zeros, global REAL* target, const REAL negative_slope, const Gather s) {
  const int source_depth = s.source_channels / s.groups, target_depth = s.target_channels / s.groups;
  const int panels = (target_depth + PANEL - 1) / PANEL;
  // Not get_global_id(s.tile_axis): with PoCL the loops below lose a fifth to it, measured.
  const int panel_of_all = s.tile_axis ? get_global_id(0) : get_global_id(1);
  const int group = panel_of_all / panels, panel = panel_of_all % panels;
  const int phase_y = (int)get_global_id(2) / s.target_step.x, phase_x = (int)get_global_id(2) % s.target_step.x;
  const int height = (s.target_height - phase_y + s.target_step.y - 1) / s.target_step.y;
  const int width = (s.target_width - phase_x + s.target_step.x - 1) / s.target_step.x;
  const int count = s.batch * height * width;
  if (group >= s.groups || phase_y >= s.target_step.y || count == 0) return;

  // First tap of the phase on each axis, and the source position it reads at lattice position 0.
  const int tap_y = (s.kernel_size.y * s.target_step.y - phase_y - s.lead.y) % s.target_step.y;
  const int tap_x = (s.kernel_size.x * s.target_step.x - phase_x - s.lead.x) % s.target_step.x;
  const int top = (phase_y + s.lead.y + tap_y) / s.target_step.y, left = (phase_x + s.lead.x + tap_x) / s.target_step.x;
  const int taps_y = (s.kernel_size.y - tap_y + s.target_step.y - 1) / s.target_step.y;
  const int taps_x = (s.kernel_size.x - tap_x + s.target_step.x - 1) / s.target_step.x;

  const int channel = group * target_depth + panel * PANEL;
  const int lanes = target_depth - panel * PANEL;
  // The phase's own corner of each array.
  global const REAL* const sources = source + group * source_depth;
  global const REAL* const weights = weight + (long)group * s.group_stride + (long)panel * s.panel_stride +
                                     (long)(tap_y * s.kernel_size.x + tap_x) * s.tap_stride;
  global const REAL* const biases = bias + channel;
  global REAL* const targets = target + channel;
  const bool has_bias = s.bias_kind != 0;
  const int bias_stride = s.bias_kind == 2 ? s.target_channels : 0;
  const long source_line = (long)s.source_width * s.source_channels;
  const long weight_line = (long)s.target_step.y * s.kernel_size.x * s.tap_stride;
  const int weight_column = s.target_step.x * s.tap_stride;
  const int pitch = s.source_step.x * s.source_channels, target_pitch = s.target_step.x * s.target_channels;
  // Without groups a kernel row's taps lie side by side in source and weight: one long run where no tap is outside.
  const bool merged = s.groups == 1 && s.target_step.x == 1;
  // What this tile's end and a later tile's last kernel row will need.
  const int columns_ahead = TILES_AHEAD * PIXELS * s.source_step.x + taps_x - 1;
  const long ahead = (taps_y - 1) * source_line + columns_ahead * s.source_channels;

  const int begin = (int)(s.tile_axis ? get_global_id(1) : get_global_id(0)) * s.tiles_per_item * PIXELS;
  const int end = min(count, begin + s.tiles_per_item * PIXELS);
  // Lattice position of the next pixel; pixels are walked in memory order, so only the start needs divisions.
  int column = begin % width, line = begin / width % height, image = begin / width / height;
  for (int tile = begin; tile < end; tile += PIXELS) {
    global const REAL* corner[PIXELS];  // where the first tap reads, if it is inside
    REALV sum[PIXELS][VECTORS];
#pragma unroll
    for (int p = 0; p < PIXELS; ++p) {
#pragma unroll
      for (int v = 0; v < VECTORS; ++v) sum[p][v] = 0;
    }
    const int first_y = line * s.source_step.y + top, first_x = column * s.source_step.x + left;
    const int first_position =
        (line * s.target_step.y + phase_y) * s.target_width + column * s.target_step.x + phase_x;
    const int last_x = first_x + (PIXELS - 1) * s.source_step.x;
    if (column + PIXELS <= width && first_x >= 0 && last_x + taps_x <= s.source_width && first_y >= 0 &&
        first_y + taps_y <= s.source_height) {
      // The usual case: pixels of one line, every tap inside.
      corner[0] = sources + ((long)image * s.source_height + first_y) * source_line + first_x * s.source_channels;
      global const REAL* bias_at = biases + (long)first_position * bias_stride;
      global REAL* target_at =
          targets + ((long)image * s.target_height * s.target_width + first_position) * s.target_channels;
#pragma unroll
      for (int p = 0; p < PIXELS; ++p) {
        if (p > 0) corner[p] = corner[p - 1] + pitch;
        for (int k = 0; k < source_depth; k += CACHE_LINE) PREFETCH(corner[p] + ahead + k);
#pragma unroll
        for (int v = 0; v < VECTORS; ++v) {
          PREFETCH(bias_at + p * s.target_step.x * bias_stride + v * V);
          PREFETCH_WRITE(target_at + p * target_pitch + v * V);
        }
      }
      for (int ty = 0; ty < taps_y; ++ty) {
        if (merged) {
          multiply_add(sum, corner, ty * source_line, weights + ty * weight_line, taps_x * source_depth, s.row_stride);
        } else {
          for (int tx = 0; tx < taps_x; ++tx) {
            multiply_add(sum, corner, ty * source_line + tx * s.source_channels,
                         weights + ty * weight_line + tx * weight_column, source_depth, s.row_stride);
          }
        }
      }
#pragma unroll
      for (int p = 0; p < PIXELS; ++p) {
        finish_pixel(sum[p], bias_at, has_bias, target_at, lanes, negative_slope);
        bias_at += s.target_step.x * bias_stride;
        target_at += target_pitch;
      }
      column += PIXELS;
      if (column == width) {
        column = 0;
        image += ++line == height;
        line = line == height ? 0 : line;
      }
    } else {
      int y[PIXELS], x[PIXELS], picture[PIXELS], position[PIXELS];
#pragma unroll
      for (int p = 0; p < PIXELS; ++p) {
        y[p] = line * s.source_step.y + top;
        x[p] = column * s.source_step.x + left;
        picture[p] = image;
        position[p] = (line * s.target_step.y + phase_y) * s.target_width + column * s.target_step.x + phase_x;
        corner[p] = sources + ((long)image * s.source_height + y[p]) * source_line + x[p] * s.source_channels;
        // Pixels behind the last one repeat it; they are not stored.
        if (tile + p + 1 < count) {
          const bool next_line = column + 1 == width, next_image = next_line && line + 1 == height;
          column = next_line ? 0 : column + 1;
          line = next_image ? 0 : line + next_line;
          image += next_image;
        }
      }
      for (int ty = 0; ty < taps_y; ++ty) {
        bool any = false;
#pragma unroll
        for (int p = 0; p < PIXELS; ++p) any |= y[p] + ty >= 0 && y[p] + ty < s.source_height;
        for (int tx = 0; tx < taps_x && any; ++tx) {
          global const REAL* values[PIXELS];
#pragma unroll
          for (int p = 0; p < PIXELS; ++p) {
            const int sy = y[p] + ty, sx = x[p] + tx;
            const bool inside = sy >= 0 && sy < s.source_height && sx >= 0 && sx < s.source_width;
            values[p] = inside ? corner[p] + ty * source_line + tx * s.source_channels : zeros;
          }
          multiply_add(sum, values, 0, weights + ty * weight_line + tx * weight_column, source_depth, s.row_stride);
        }
      }
#pragma unroll
      for (int p = 0; p < PIXELS; ++p) {
        if (tile + p < end) {
          const long pixel = (long)picture[p] * s.target_height * s.target_width + position[p];
          finish_pixel(sum[p], biases + (long)position[p] * bias_stride, has_bias, targets + pixel * s.target_channels,
                       lanes, negative_slope);
        }
      }
    }
  }
}

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

// repeated = bias, over and over: that of a folded pixel
// Launch: one item per element; local size free.
kernel void repeat_bias(global const REAL* bias, global REAL* repeated, const int channels, const int count) {
  const int i = get_global_id(0);
  if (i < count) repeated[i] = bias[i % channels];
}
