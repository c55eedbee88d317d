// The gradient with respect to the weights of 3 x 3 convolutions of stride 1 on CPUs, by Winograd's minimal filtering
// (see common/winograd.cl): patches of the input and tiles of the output's gradient at the 36 points, multiplied there
// and summed over the tiles; then the sums are brought back to the nine taps. A quarter of conv2d_gradient.cl's
// multiply-adds. Sums are split into ranges of tiles whose results are then added in order: deterministic.
//
// -D DEPTH, OUTPUT_DEPTH: channels / group of the input and of the output, multiples of V. -D TILES: tiles of 4 x 4
// output pixels whose points lie in the core's second cache at once. -D LINES: of the six lines of six points an item
// does so many (6, 3, 2 or 1), so that its sums stay in that cache too. -D ROWS: input channels it sums in registers at
// once, a divisor of V, with VECTORS vectors of output channels each.
#include "common/winograd.cl"

#define TILES_AHEAD 2  // distance of prefetches
// Between the points of one tile: an odd number of vectors, or the points would fall into few sets of the first cache.
#define VALUE_STRIDE (TILES * DEPTH + V)
#define GRADIENT_STRIDE (TILES * OUTPUT_DEPTH + V)

typedef struct {
  Plane input, output;
  int batch, groups, padding, tiles_per_split;
} WinogradGradient;

// The 4 x 4 tile of the output's gradient at y, x, all channels of a group: to[point * GRADIENT_STRIDE + channel], the
// points of LINES lines. Pixels outside of the plane are zeros; inside: there are none, known when compiled.
__attribute__((always_inline)) inline void tile_to_points(global const REAL* gradient, const Plane plane, const int y,
                                                          const int x, const bool inside, const int first_line,
                                                          local REAL* to) {
  for (int c = 0; c < OUTPUT_DEPTH; c += V) {
    REALV column[LINES][4];  // points along y, by the pixel's x
#pragma unroll
    for (int dx = 0; dx < 4; ++dx) {
      REALV d[4], point[6];
#pragma unroll
      for (int dy = 0; dy < 4; ++dy) {
        d[dy] = 0;
        if (inside || (y + dy < plane.height && x + dx < plane.width))
          d[dy] = LOAD_VECTOR(0, gradient + ((long)(y + dy) * plane.width + x + dx) * plane.channels + c);
      }
      target_to_points(d, point);
#pragma unroll
      for (int i = 0; i < LINES; ++i) column[i][dx] = point[first_line + i];
    }
#pragma unroll
    for (int i = 0; i < LINES; ++i) {
      REALV point[6];
      target_to_points(column[i], point);
#pragma unroll
      for (int j = 0; j < 6; ++j) STORE_VECTOR(point[j], 0, to + (i * 6 + j) * GRADIENT_STRIDE + c);
    }
  }
}

// Hints of the tile at y, x.
inline void prefetch_tile(global const REAL* gradient, const Plane plane, const int y, const int x) {
  for (int dy = 0; dy < WINOGRAD_TILE; ++dy) {
    for (int dx = 0; dx < WINOGRAD_TILE; ++dx) {
      for (int c = 0; c < OUTPUT_DEPTH; c += CACHE_LINE)
        PREFETCH(gradient + ((long)(y + dy) * plane.width + x + dx) * plane.channels + c);
    }
  }
}

// At each point of LINES lines: sums (DEPTH, OUTPUT_DEPTH) += values (tiles, DEPTH) transposed * gradients (tiles,
// OUTPUT_DEPTH); the first time: =.
inline void add_products(local const REAL* values, local const REAL* gradients, const int tiles, const bool first_time,
                         global REAL* sums) {
  for (int point = 0; point < LINES * 6; ++point) {
    for (int k = 0; k < DEPTH; k += ROWS) {
      for (int c = 0; c < OUTPUT_DEPTH; c += VECTORS * V) {
        global REAL* to = sums + ((long)point * DEPTH + k) * OUTPUT_DEPTH + c;
        REALV sum[ROWS][VECTORS];
#pragma unroll
        for (int r = 0; r < ROWS; ++r) {
#pragma unroll
          for (int v = 0; v < VECTORS; ++v) {
            sum[r][v] = 0;
            if (!first_time) sum[r][v] = LOAD_VECTOR(v, to + r * OUTPUT_DEPTH);
          }
        }
        local const REAL* value = values + point * VALUE_STRIDE + k;
        local const REAL* factor = gradients + point * GRADIENT_STRIDE + c;
        for (int tile = 0; tile < tiles; ++tile, value += DEPTH, factor += OUTPUT_DEPTH) {
          REALV factors[VECTORS];
#pragma unroll
          for (int v = 0; v < VECTORS; ++v) factors[v] = LOAD_VECTOR(v, factor);
#pragma unroll
          for (int r = 0; r < ROWS; ++r) {
#pragma unroll
            for (int v = 0; v < VECTORS; ++v) sum[r][v] = fma((REALV)(value[r]), factors[v], sum[r][v]);
          }
        }
#pragma unroll
        for (int r = 0; r < ROWS; ++r) {
#pragma unroll
          for (int v = 0; v < VECTORS; ++v) STORE_VECTOR(sum[r][v], v, to + r * OUTPUT_DEPTH);
        }
      }
    }
  }
}

// partial (splits, groups, 36, DEPTH, OUTPUT_DEPTH): each split's sums at the points. gradient: of the output before its
// activation. Launch: (6 / LINES, splits, groups); local size {1, 1, 1}. values, gradients: local memory for the points
// of TILES tiles, of DEPTH and of OUTPUT_DEPTH channels.
kernel void weight_gradient_winograd(global const REAL* input, global const REAL* gradient, global REAL* partial,
                                     const WinogradGradient s, local REAL* values, local REAL* gradients) {
  const int first_line = (int)get_global_id(0) * LINES, split = get_global_id(1), group = get_global_id(2);
  const int width = (s.output.width + WINOGRAD_TILE - 1) / WINOGRAD_TILE;
  const int height = (s.output.height + WINOGRAD_TILE - 1) / WINOGRAD_TILE;
  const int begin = split * s.tiles_per_split, end = min(s.batch * height * width, begin + s.tiles_per_split);
  if (first_line >= 6 || group >= s.groups || begin >= end) return;
  const long input_image = (long)s.input.height * s.input.width * s.input.channels;
  const long output_image = (long)s.output.height * s.output.width * s.output.channels;
  global REAL* const sums =
      partial + (((long)split * s.groups + group) * WINOGRAD_POINTS + first_line * 6) * DEPTH * OUTPUT_DEPTH;

  for (int block = begin; block < end; block += TILES) {
    const int tiles = min(TILES, end - block);
    for (int tile = 0; tile < tiles; ++tile) {
      const int of_all = block + tile, image = of_all / width / height;
      const int y = of_all / width % height * WINOGRAD_TILE, x = of_all % width * WINOGRAD_TILE;
      const int from_y = y - s.padding, from_x = x - s.padding;
      global const REAL* const patch_from = input + image * input_image + group * DEPTH;
      local REAL* const patch_to = values + tile * DEPTH;
      prefetch_patch(patch_from, s.input, from_y, from_x + TILES_AHEAD * WINOGRAD_TILE, DEPTH);
      if (patch_is_inside(s.input, from_y, from_x)) {
        patch_to_points(patch_from, s.input, from_y, from_x, true, DEPTH, first_line, LINES, patch_to, VALUE_STRIDE);
      } else {
        patch_to_points(patch_from, s.input, from_y, from_x, false, DEPTH, first_line, LINES, patch_to, VALUE_STRIDE);
      }
      global const REAL* const tile_from = gradient + image * output_image + group * OUTPUT_DEPTH;
      local REAL* const tile_to = gradients + tile * OUTPUT_DEPTH;
      prefetch_tile(tile_from, s.output, y, x + TILES_AHEAD * WINOGRAD_TILE);
      if (y + WINOGRAD_TILE <= s.output.height && x + WINOGRAD_TILE <= s.output.width) {
        tile_to_points(tile_from, s.output, y, x, true, first_line, tile_to);
      } else {
        tile_to_points(tile_from, s.output, y, x, false, first_line, tile_to);
      }
    }
    add_products(values, gradients, tiles, block == begin, sums);
  }
}

// weight_gradient (groups, 3, 3, DEPTH, OUTPUT_DEPTH) from the sums of all splits.
// Launch: (vectors of output channels, DEPTH, groups); local size free.
kernel void points_to_weights(global const REAL* partial, global REAL* weight_gradient, const int splits,
                              const int groups) {
  const int c = (int)get_global_id(0) * V, k = get_global_id(1), group = get_global_id(2);
  if (c >= OUTPUT_DEPTH || k >= DEPTH || group >= groups) return;
  const long point_stride = (long)DEPTH * OUTPUT_DEPTH, at = (long)k * OUTPUT_DEPTH + c;
  REALV line[3][6];
#pragma unroll
  for (int x = 0; x < 6; ++x) {
    REALV point[6], taps[3];
#pragma unroll
    for (int y = 0; y < 6; ++y) {
      point[y] = 0;
      for (int split = 0; split < splits; ++split) {
        point[y] += LOAD_VECTOR(0, partial + (((long)split * groups + group) * WINOGRAD_POINTS + y * 6 + x) * point_stride +
                                       at);
      }
    }
    points_to_taps(point, taps);
#pragma unroll
    for (int y = 0; y < 3; ++y) line[y][x] = taps[y];
  }
#pragma unroll
  for (int y = 0; y < 3; ++y) {
    REALV taps[3];
    points_to_taps(line[y], taps);
#pragma unroll
    for (int x = 0; x < 3; ++x)
      STORE_VECTOR(taps[x], 0, weight_gradient + ((group * 3 + y) * 3 + x) * point_stride + at);
  }
}
