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
// weight: panels as conv2d_packing.cl makes them, or the plain tensor where panels divide it; the strides say which.
// -D PIXELS: target pixels an item holds in registers. -D VECTORS: vectors of V channels it holds for each.
// Launch gather: (panels * groups, items over the pixels of a phase, phases), the first two in either order; local size
// free, {1, 1, 1} on CPUs.
#include "common/gather.cl"

#define TILES_AHEAD 2  // distance of prefetches

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
  const bool has_bias = s.bias_kind == 2;
  REALV start[VECTORS];
  start_sums(start, bias, group, panel, s);
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
      for (int v = 0; v < VECTORS; ++v) sum[p][v] = start[v];
    }
    const int first_y = line * s.source_step.y + top, first_x = column * s.source_step.x + left;
    const int first_position =
        (line * s.target_step.y + phase_y) * s.target_width + column * s.target_step.x + phase_x;
    const int last_x = first_x + (PIXELS - 1) * s.source_step.x;
    if (column + PIXELS <= width && first_x >= 0 && last_x + taps_x <= s.source_width && first_y >= 0 &&
        first_y + taps_y <= s.source_height) {
      // The usual case: pixels of one line, every tap inside.
      corner[0] = sources + ((long)image * s.source_height + first_y) * source_line + first_x * s.source_channels;
      global REAL* target_at =
          targets + ((long)image * s.target_height * s.target_width + first_position) * s.target_channels;
      // Without such a bias only prefetched, and not the target where it is streamed.
      global const REAL* bias_at = STREAM ? source : target_at;
      if (has_bias) bias_at = biases + (long)first_position * s.target_channels;
#pragma unroll
      for (int p = 0; p < PIXELS; ++p) {
        if (p > 0) corner[p] = corner[p - 1] + pitch;
        for (int k = 0; k < source_depth; k += CACHE_LINE) PREFETCH(corner[p] + ahead + k);
#pragma unroll
        for (int v = 0; v < VECTORS; ++v) {
          PREFETCH(bias_at + p * target_pitch + v * V);
          if (!STREAM) PREFETCH_WRITE(target_at + p * target_pitch + v * V);
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
        bias_at += target_pitch;
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
          finish_pixel(sum[p], biases + (long)position[p] * s.target_channels, has_bias,
                       targets + pixel * s.target_channels, lanes, negative_slope);
        }
      }
    }
  }
}
