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
#include "common/tail.cl"

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

// zeros: source channels / group of them, read in place of pixels outside the source.
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
  // The phase's own corner of each array.
  global const REAL* const sources = source + group * source_depth;
  global const REAL* const weights = weight + (long)group * s.group_stride + (long)panel * s.panel_stride +
                                     (long)(tap_y * s.kernel_size + tap_x) * s.tap_stride;
  global const REAL* const biases = bias + channel;
  global REAL* const targets = target + channel;
  const bool has_bias = s.bias_kind != 0;
  const int bias_stride = s.bias_kind == 2 ? s.target_channels : 0;
  const long source_line = (long)s.source_width * s.source_channels;
  const long weight_line = (long)s.target_step * s.kernel_size * s.tap_stride;
  const int weight_column = s.target_step * s.tap_stride;
  const int pitch = s.source_step * s.source_channels, target_pitch = s.target_step * s.target_channels;
  // Without groups a kernel row's taps lie side by side in source and weight: one long run where no tap is outside.
  const bool merged = s.groups == 1 && s.target_step == 1;
  // What this tile's end and a later tile's last kernel row will need.
  const int columns_ahead = TILES_AHEAD * PIXELS * s.source_step + taps_x - 1;
  const long ahead = (taps_y - 1) * source_line + columns_ahead * s.source_channels;

  const int begin = (int)get_global_id(1) * s.tiles_per_item * PIXELS;
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
    const int first_y = line * s.source_step + top, first_x = column * s.source_step + left;
    const int first_position =
        (line * s.target_step + phase_y) * s.target_width + column * s.target_step + phase_x;
    const int last_x = first_x + (PIXELS - 1) * s.source_step;
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
          PREFETCH(bias_at + p * s.target_step * bias_stride + v * V);
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
        bias_at += s.target_step * bias_stride;
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
        y[p] = line * s.source_step + top;
        x[p] = column * s.source_step + left;
        picture[p] = image;
        position[p] = (line * s.target_step + phase_y) * s.target_width + column * s.target_step + phase_x;
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
        for (int tx = 0; tx < taps_x; ++tx) {
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
