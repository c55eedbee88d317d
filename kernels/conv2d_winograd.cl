// The gather kernel of conv2d.cl for 3 x 3 kernels of step 1 on CPUs, by Winograd's minimal filtering (see
// common/winograd.cl): a quarter of the multiply-adds, at the price of the transforms, which wide layers repay.
//
// An item takes TILES tiles of 4 x 4 target pixels in the order of memory. It brings their source patches to the 36
// points, multiplies at each point by the kernel's, channels by channels, and brings the sums back. Both arrays of
// points stay in the core's second cache.
// -D DEPTH: source channels / group, a multiple of V, known when compiled since a tile's addresses are then one pointer
// and constants. -D TILES: multiple of PIXELS. -D PIXELS: tiles that are summed in registers at once, with VECTORS
// vectors of V channels each.
#include "common/gather.cl"
#include "common/winograd.cl"

#define TILES_AHEAD 2  // distance of prefetches
// Between the points of one tile: an odd number of vectors, or the points would fall into few sets of the first cache.
#define VALUE_STRIDE (TILES * DEPTH + V)
#define SUM_STRIDE (TILES * PANEL + V)

// points (groups, panels, 36, DEPTH, panel) from packed (groups, panels, 3, 3, DEPTH, panel).
// Launch: (vectors of a panel, DEPTH, groups * panels); local size free.
kernel void weights_to_points(global const REAL* packed, global REAL* points, const int panels_of_all) {
  const int v = get_global_id(0), k = get_global_id(1), panel = get_global_id(2);
  if (v >= VECTORS || k >= DEPTH || panel >= panels_of_all) return;
  global const REAL* from = packed + ((long)panel * 9 * DEPTH + k) * PANEL + v * V;
  global REAL* to = points + ((long)panel * WINOGRAD_POINTS * DEPTH + k) * PANEL + v * V;
  REALV line[6][3];
#pragma unroll
  for (int x = 0; x < 3; ++x) {
    REALV taps[3], point[6];
#pragma unroll
    for (int y = 0; y < 3; ++y) taps[y] = LOAD_VECTOR(0, from + (y * 3 + x) * DEPTH * PANEL);
    taps_to_points(taps, point);
#pragma unroll
    for (int y = 0; y < 6; ++y) line[y][x] = point[y];
  }
#pragma unroll
  for (int y = 0; y < 6; ++y) {
    REALV point[6];
    taps_to_points(line[y], point);
#pragma unroll
    for (int x = 0; x < 6; ++x) STORE_VECTOR(point[x], 0, to + (y * 6 + x) * DEPTH * PANEL);
  }
}

// At each point the sums (tiles, panel) = values (tiles, DEPTH) * weight (DEPTH, panel); tiles: multiple of PIXELS.
inline void multiply_points(local const REAL* values, global const REAL* weight, local REAL* sums, const int tiles) {
  for (int point = 0; point < WINOGRAD_POINTS; ++point) {
    for (int tile = 0; tile < tiles; tile += PIXELS) {
      local const REAL* value = values + point * VALUE_STRIDE + tile * DEPTH;
      global const REAL* w = weight + (long)point * DEPTH * PANEL;
      REALV sum[PIXELS][VECTORS];
#pragma unroll
      for (int p = 0; p < PIXELS; ++p) {
#pragma unroll
        for (int v = 0; v < VECTORS; ++v) sum[p][v] = 0;
      }
      for (int k = 0; k < DEPTH; ++k, w += PANEL) {
        REALV factor[VECTORS];
#pragma unroll
        for (int v = 0; v < VECTORS; ++v) factor[v] = LOAD_VECTOR(v, w);
#pragma unroll
        for (int p = 0; p < PIXELS; ++p) {
#pragma unroll
          for (int v = 0; v < VECTORS; ++v) sum[p][v] = fma((REALV)(value[p * DEPTH + k]), factor[v], sum[p][v]);
        }
      }
      local REAL* to = sums + point * SUM_STRIDE + tile * PANEL;
#pragma unroll
      for (int p = 0; p < PIXELS; ++p) {
#pragma unroll
        for (int v = 0; v < VECTORS; ++v) STORE_VECTOR(sum[p][v], p * VECTORS + v, to);
      }
    }
  }
}

// Hints of a tile's target and, where it is not null, of its untied bias; both point to the tile's first pixel.
inline void prefetch_target(global const REAL* target, global const REAL* bias, const Gather s) {
  for (int dy = 0; dy < WINOGRAD_TILE; ++dy) {
    for (int dx = 0; dx < WINOGRAD_TILE; ++dx) {
      for (int v = 0; v < VECTORS; ++v) {
        const long at = ((long)dy * s.target_width + dx) * s.target_channels + v * V;
        if (bias) PREFETCH(bias + at);
        if (!STREAM) PREFETCH_WRITE(target + at);
      }
    }
  }
}

// The target pixels of a tile, a panel of channels, from its sums at the 36 points: sums[point * SUM_STRIDE + channel].
// y, x: the tile's first pixel. target, bias: the panel's first channel of the image and of the untied bias.
inline void points_to_tile(local const REAL* sums, const REALV start[VECTORS], global const REAL* bias,
                           const bool has_bias, global REAL* target, const int y, const int x, const int lanes,
                           const REAL negative_slope, const Gather s) {
  REALV column[VECTORS][4][6];  // values along y, points along x
#pragma unroll
  for (int v = 0; v < VECTORS; ++v) {
#pragma unroll
    for (int dx = 0; dx < 6; ++dx) {
      REALV point[6], value[4];
#pragma unroll
      for (int dy = 0; dy < 6; ++dy) point[dy] = LOAD_VECTOR(v, sums + (dy * 6 + dx) * SUM_STRIDE);
      points_to_target(point, value);
#pragma unroll
      for (int dy = 0; dy < 4; ++dy) column[v][dy][dx] = value[dy];
    }
  }
#pragma unroll
  for (int dy = 0; dy < WINOGRAD_TILE; ++dy) {
    REALV pixel[WINOGRAD_TILE][VECTORS];
#pragma unroll
    for (int v = 0; v < VECTORS; ++v) {
      REALV value[4];
      points_to_target(column[v][dy], value);
#pragma unroll
      for (int dx = 0; dx < WINOGRAD_TILE; ++dx) pixel[dx][v] = value[dx] + start[v];
    }
#pragma unroll
    for (int dx = 0; dx < WINOGRAD_TILE; ++dx) {
      if (y + dy < s.target_height && x + dx < s.target_width) {
        const long at = ((long)(y + dy) * s.target_width + x + dx) * s.target_channels;
        finish_pixel(pixel[dx], bias + at, has_bias, target + at, lanes, negative_slope);
      }
    }
  }
}

// Launch: (items over the tiles, groups); local size {1, 1}. values, sums: local memory for the points of TILES tiles, of
// DEPTH channels and of a panel.
kernel void gather_winograd(global const REAL* source, global const REAL* points, global const REAL* bias,
                            global REAL* target, const REAL negative_slope, const Gather s, local REAL* values,
                            local REAL* sums) {
  const int group = get_global_id(1), begin = (int)get_global_id(0) * TILES;
  const int target_depth = s.target_channels / s.groups, panels = (target_depth + PANEL - 1) / PANEL;
  const int width = (s.target_width + WINOGRAD_TILE - 1) / WINOGRAD_TILE;
  const int height = (s.target_height + WINOGRAD_TILE - 1) / WINOGRAD_TILE;
  const int tiles = min(TILES, s.batch * height * width - begin);
  if (group >= s.groups || tiles <= 0) return;
  const Plane plane = {s.source_height, s.source_width, s.source_channels};
  const long source_image = (long)s.source_height * s.source_width * s.source_channels;
  const long target_image = (long)s.target_height * s.target_width * s.target_channels;

  for (int tile = 0; tile < tiles; ++tile) {
    const int of_all = begin + tile;
    const int y = of_all / width % height * WINOGRAD_TILE + s.lead.y, x = of_all % width * WINOGRAD_TILE + s.lead.x;
    global const REAL* const from = source + of_all / width / height * source_image + group * DEPTH;
    local REAL* const to = values + tile * DEPTH;
    prefetch_patch(from, plane, y, x + TILES_AHEAD * WINOGRAD_TILE, DEPTH);
    if (patch_is_inside(plane, y, x)) {
      patch_to_points(from, plane, y, x, true, DEPTH, 0, 6, to, VALUE_STRIDE);
    } else {
      patch_to_points(from, plane, y, x, false, DEPTH, 0, 6, to, VALUE_STRIDE);
    }
  }
  // The sums of tiles that do not exist are not read, but numbers are added up to them.
  const int summed = (tiles + PIXELS - 1) / PIXELS * PIXELS;
  for (int point = 0; point < WINOGRAD_POINTS; ++point) {
    for (int k = tiles * DEPTH; k < summed * DEPTH; ++k) values[point * VALUE_STRIDE + k] = 0;
  }

  for (int panel = 0; panel < panels; ++panel) {
    multiply_points(values, points + (long)(group * panels + panel) * WINOGRAD_POINTS * DEPTH * PANEL, sums, summed);
    const int lanes = target_depth - panel * PANEL, channel = group * target_depth + panel * PANEL;
    const bool has_bias = s.bias_kind == 2;
    REALV start[VECTORS];
    start_sums(start, bias, group, panel, s);
    for (int tile = 0; tile < tiles; ++tile) {
      const int of_all = begin + tile;
      const int y = of_all / width % height * WINOGRAD_TILE, x = of_all % width * WINOGRAD_TILE;
      global REAL* const to = target + of_all / width / height * target_image + channel;
      const long ahead = ((long)y * s.target_width + x + TILES_AHEAD * WINOGRAD_TILE) * s.target_channels;
      prefetch_target(to + ahead, has_bias ? bias + channel + ahead : 0, s);
      points_to_tile(sums + tile * PANEL, start, bias + channel, has_bias, to, y, x, lanes, negative_slope, s);
    }
  }
}
