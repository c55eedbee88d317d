// The gather kernel of conv2d.cl for narrow layers on CPUs, where target_step is 1 and a pixel's channels fit a vector.
// With so few sums loads and the latency of multiply-adds would set the pace. So an item takes PIXELS neighbouring
// pixels of one line, and a value of the source, once loaded, serves every tap of a kernel row that reads it.
// -D PIXELS: as in conv2d.cl. -D TAPS: of a kernel row. -D STEP: source_step.x. -D SOURCE_CHANNELS: of all groups,
// known when compiled, since a tile's many addresses are then one pointer and constants.
// -D HALVES=1: groups of V / 2 channels; a folded pixel's halves are those of two neighbouring pixels, which lie all
// groups' channels apart. -D HALF_V=V / 2.
// Launch: (groups, items over tiles, 1), the first two in either order; local size {1, 1, 1}.
#define VECTORS 1
#include "common/gather.cl"

#define COLUMNS ((PIXELS - 1) * STEP + TAPS)  // source pixels of a line that a tile reads

// sum[p] += from[p * STEP + t][k] * (line k of tap t of w), t < TAPS, k < depth
__attribute__((always_inline)) inline void multiply_add_row(REALV sum[PIXELS], global const REAL* const from[COLUMNS],
                                                            global const REAL* w, const int depth,
                                                            const int tap_stride, const int row_stride) {
  for (int k = 0; k < depth; ++k, w += row_stride) {
    REALV factor[TAPS];
#pragma unroll
    for (int t = 0; t < TAPS; ++t) factor[t] = LOAD_VECTOR(0, w + t * tap_stride);
#pragma unroll
    for (int c = 0; c < COLUMNS; ++c) {
      const REALV value = (REALV)(from[c][k]);
#pragma unroll
      for (int t = 0; t < TAPS; ++t) {
        if (c >= t && (c - t) % STEP == 0 && (c - t) / STEP < PIXELS)
          sum[(c - t) / STEP] = fma(value, factor[t], sum[(c - t) / STEP]);
      }
    }
  }
}

#if HALVES
#define HALF_REALV JOIN(REAL, HALF_V)
#define LOAD_HALF JOIN(vload, HALF_V)
#define STORE_HALF JOIN(vstore, HALF_V)

inline void finish_halves(REALV value, global const REAL* bias, const bool has_bias, global REAL* target,
                          const int pixel_stride, const REAL negative_slope) {
  if (has_bias) value += (REALV)(LOAD_HALF(0, bias), LOAD_HALF(0, bias + pixel_stride));
  value = value > 0 ? value : value * negative_slope;
  STORE_HALF(value.lo, 0, target);
  STORE_HALF(value.hi, 0, target + pixel_stride);
}
#endif

// zeros: at least source channels / group of them, read in place of pixels outside the source.
kernel void gather_rows(global const REAL* source, global const REAL* weight, global const REAL* bias,
                        global const REAL* zeros, global REAL* target, const REAL negative_slope, const Gather s) {
  const int depth = SOURCE_CHANNELS / s.groups, lanes = s.target_channels / s.groups;
  // Both are read before one is taken: PoCL 3.1 fails to link a choice between the calls.
  const int item_0 = get_global_id(0), item_1 = get_global_id(1);
  const int group = s.tile_axis ? item_0 : item_1, begin = (s.tile_axis ? item_1 : item_0) * s.tiles_per_item;
  const int tiles_per_line = (s.target_width + PIXELS - 1) / PIXELS;
  const int end = min(s.batch * s.target_height * tiles_per_line, begin + s.tiles_per_item);
  if (group >= s.groups || begin >= end) return;

  const int channel = group * (HALVES ? lanes / 2 : lanes);
  global const REAL* const sources = source + group * depth;
  global const REAL* const weights = weight + (long)group * s.group_stride;
  const long source_line = (long)s.source_width * SOURCE_CHANNELS;
  const bool has_bias = s.bias_kind == 2;
  REALV start[1];
  start_sums(start, bias, group, 0, s);

  int column = begin % tiles_per_line * PIXELS, line = begin / tiles_per_line;  // line: of all images
  for (int tile = begin; tile < end; ++tile) {
    REALV sum[PIXELS];
#pragma unroll
    for (int p = 0; p < PIXELS; ++p) sum[p] = start[0];
    const int image = line / s.target_height, row = line - image * s.target_height;
    const int top = row * s.source_step.y + s.lead.y, left = column * STEP + s.lead.x;
    const bool inside = left >= 0 && left + COLUMNS <= s.source_width;
    global REAL* target_at = target + ((long)line * s.target_width + column) * s.target_channels + channel;
    // Without such a bias only prefetched, and not the target where it is streamed.
    global const REAL* bias_at = STREAM ? source : target_at;
    if (has_bias) bias_at = bias + ((long)row * s.target_width + column) * s.target_channels + channel;
    global const REAL* first = sources + ((long)image * s.source_height + top) * source_line + left * SOURCE_CHANNELS;
#pragma unroll
    for (int p = 0; p < PIXELS; ++p) {
      PREFETCH(bias_at + p * s.target_channels);
      if (!STREAM) PREFETCH_WRITE(target_at + p * s.target_channels);
    }
    // What the next tile will be the first to read.
    global const REAL* ahead = first + (s.kernel_size.y - 1) * source_line + PIXELS * STEP * SOURCE_CHANNELS;
    for (int c = 0; c < PIXELS * STEP; ++c) {
      for (int k = 0; k < depth; k += CACHE_LINE) PREFETCH(ahead + c * SOURCE_CHANNELS + k);
    }
    for (int ty = max(0, -top); ty < min(s.kernel_size.y, s.source_height - top); ++ty) {
      global const REAL* const w = weights + (long)ty * TAPS * s.tap_stride;
      global const REAL* from[COLUMNS];
      // Two calls, since constant distances between the columns make the usual case's addresses free.
      if (inside) {
#pragma unroll
        for (int c = 0; c < COLUMNS; ++c) from[c] = first + ty * source_line + c * SOURCE_CHANNELS;
        multiply_add_row(sum, from, w, depth, s.tap_stride, s.row_stride);
      } else {
#pragma unroll
        for (int c = 0; c < COLUMNS; ++c) {
          const bool exists = left + c >= 0 && left + c < s.source_width;
          from[c] = exists ? first + ty * source_line + c * SOURCE_CHANNELS : zeros;
        }
        multiply_add_row(sum, from, w, depth, s.tap_stride, s.row_stride);
      }
    }
#pragma unroll
    for (int p = 0; p < PIXELS; ++p) {
      if (column + p < s.target_width) {
#if HALVES
        finish_halves(sum[p], bias_at, has_bias, target_at, s.target_channels / 2, negative_slope);
#else
        finish_pixel(sum + p, bias_at, has_bias, target_at, lanes, negative_slope);
#endif
        bias_at += s.target_channels;
        target_at += s.target_channels;
      }
    }
    column += PIXELS;
    if (column >= s.target_width) {
      column = 0;
      ++line;
    }
  }
}
