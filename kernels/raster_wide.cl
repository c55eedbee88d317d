// Rasterisation of projected splats for wide vectors: one item composites a tile, REALV is a row of 16 pixels, no
// barrier. A splat visits only the rows of the tile between its lowest and highest point, and rows whose pixels are all
// opaque are left out. Backward walks the same lists from the last contributor to the front and stores the sums of a
// splat over the tile into the slot of that intersection.
// -D V=16; TILE_HEIGHT: rows of a tile, 1..16; SMOOTH_CUTOFF=0|1: alpha fades in between ALPHA_MIN and 2 ALPHA_MIN
// instead of stepping (for finite differences).
// Arrays: records (N,RECORD_SIZE), tile_starts (tiles+1), order (M): slots sorted by tile, slot_splats (M), color
// (H,W,3), alpha (H,W), transmittance (H,W): what is left behind the last contributor, contributors (H,W): place in
// `order` of the pixel's last contributor, plus one, slots (M,SLOT_SIZE).
// Launch: one item per tile, local size 1. Deterministic: every element has one writer.
#include "common/real.cl"
#include "common/splat.cl"

#define TILE_WIDTH 16
#if REAL_IS_DOUBLE
#define MASKV long16
#else
#define MASKV int16
#endif
// Pixel centres of a tile's columns, and of its rows.
#define CENTERS (REALV)(0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5, 10.5, 11.5, 12.5, 13.5, 14.5, 15.5)

typedef struct {
  int left, top, columns, rows;  // first pixel and size within the image
} Tile;

inline Tile tile_at(const int index, const int width, const int height) {
  const int grid_columns = (width + TILE_WIDTH - 1) / TILE_WIDTH;
  Tile tile;
  tile.left = index % grid_columns * TILE_WIDTH;
  tile.top = index / grid_columns * TILE_HEIGHT;
  tile.columns = min(TILE_WIDTH, width - tile.left);
  tile.rows = min(TILE_HEIGHT, height - tile.top);
  return tile;
}

// A splat in a tile's own coordinates, and the rows it may touch.
typedef struct {
  REAL u, v, sharpness_x, slope, sharpness_y, log2_opacity;
  int first_row, last_row;
} TileSplat;

inline TileSplat tile_splat(const REAL* record, const Tile tile) {
  TileSplat splat;
  splat.u = record[RECORD_U] - tile.left;
  splat.v = record[RECORD_V] - tile.top;
  splat.sharpness_x = record[RECORD_SHARPNESS_X];
  splat.slope = record[RECORD_SLOPE];
  splat.sharpness_y = record[RECORD_SHARPNESS_Y];
  splat.log2_opacity = record[RECORD_LOG2_OPACITY];
  const REAL half_height = record[RECORD_HEIGHT];
  splat.first_row = (int)ceil(fmin(fmax(splat.v - half_height - (REAL)0.5, (REAL)0), (REAL)TILE_HEIGHT));
  splat.last_row = (int)floor(fmin(fmax(splat.v + half_height - (REAL)0.5, (REAL)-1), (REAL)(tile.rows - 1)));
  return splat;
}

inline REALV record_in_place(global const REAL* records, global const uint* slot_splats, const uint slot) {
  return LOAD_VECTOR((long)slot_splats[slot], records);
}

// The Gaussian along each row of the tile: log2(alpha) = peak - (sharpness_x x - center)^2, dy the row's offset.
typedef struct {
  REAL dy[V], center[V], peak[V];
} RowGaussians;

inline void row_gaussians(const TileSplat splat, const REALV row_centers, RowGaussians* rows) {
  const REALV dy = row_centers - splat.v;
  STORE_VECTOR(dy, 0, rows->dy);
  STORE_VECTOR(splat.sharpness_x * (splat.u + splat.slope * dy), 0, rows->center);
  STORE_VECTOR(splat.log2_opacity - splat.sharpness_y * dy * dy, 0, rows->peak);
}

// log2(alpha) along a row of pixels; scaled_x = sharpness_x x.
inline REALV row_exponent(const RowGaussians* rows, const int row, const REALV scaled_x) {
  const REALV s = scaled_x - rows->center[row];
  return rows->peak[row] - s * s;
}

#if SMOOTH_CUTOFF
inline REALV fade(const REALV alpha) {
  const REALV t = fmin(fmax(alpha / ALPHA_MIN - 1, (REAL)0), (REAL)1);
  return t * t * (3 - 2 * t);
}
// d (alpha fade(alpha)) / d ln(alpha), for unclamped alpha
inline REALV fade_slope(const REALV alpha) {
  const REALV t = fmin(fmax(alpha / ALPHA_MIN - 1, (REAL)0), (REAL)1);
  return alpha * (t * t * (3 - 2 * t) + alpha / ALPHA_MIN * 6 * t * (1 - t));
}
#endif

kernel void raster_forward(global const REAL* records, global const uint* tile_starts, global const uint* order,
                           global const uint* slot_splats, global REAL* color, global REAL* alpha,
                           global REAL* transmittance, global int* contributors, const REAL background_red,
                           const REAL background_green, const REAL background_blue, const int width, const int height) {
  const int tile_index = get_global_id(0);
  const Tile tile = tile_at(tile_index, width, height);
  const REALV x = CENTERS;
  REALV left_over[TILE_HEIGHT], red[TILE_HEIGHT], green[TILE_HEIGHT], blue[TILE_HEIGHT];
  MASKV last[TILE_HEIGHT];
  int open[TILE_HEIGHT];
  for (int row = 0; row < TILE_HEIGHT; ++row) {
    left_over[row] = 1;
    red[row] = green[row] = blue[row] = 0;
    last[row] = 0;
    open[row] = 1;
  }

  const uint begin = tile_starts[tile_index], end = tile_starts[tile_index + 1];
  // The next record is on its way while this one is drawn.
  REAL record[RECORD_SIZE];
  REALV next = begin < end ? record_in_place(records, slot_splats, order[begin]) : (REALV)0;
  for (uint i = begin; i < end; ++i) {
    STORE_VECTOR(next, 0, record);
    if (i + 1 < end) next = record_in_place(records, slot_splats, order[i + 1]);
    const TileSplat splat = tile_splat(record, tile);
    const REAL splat_red = record[RECORD_COLOR], splat_green = record[RECORD_COLOR + 1],
               splat_blue = record[RECORD_COLOR + 2];
    RowGaussians rows;
    row_gaussians(splat, x, &rows);
    const REALV scaled_x = x * splat.sharpness_x;
    for (int row = splat.first_row; row <= splat.last_row; ++row) {
      if (!open[row]) continue;
      const REALV exponent = row_exponent(&rows, row, scaled_x);
      REALV a = fmin(exp2_in_range(exponent), ALPHA_MAX);
#if SMOOTH_CUTOFF
      a *= fade(a);
#endif
      const REALV t = left_over[row];
      const MASKV taken = exponent >= LOG2_ALPHA_MIN && t >= TRANSMITTANCE_MIN;
      const REALV weight = taken ? a * t : (REALV)0;
      red[row] += weight * splat_red;
      green[row] += weight * splat_green;
      blue[row] += weight * splat_blue;
      left_over[row] = t - weight;
      last[row] = taken ? (MASKV)(int)(i + 1) : last[row];
    }
    // Every so often: rows with no transparent pixel close, and a tile with no open row is done.
    if (((i - begin) & 15) == 15) {
      int any_open = 0;
      for (int row = 0; row < tile.rows; ++row) {
        open[row] = open[row] && any(left_over[row] >= TRANSMITTANCE_MIN);
        any_open |= open[row];
      }
      if (!any_open) break;
    }
  }

  for (int row = 0; row < tile.rows; ++row) {
    const REALV t = left_over[row];
    REAL rest[V], r[V], g[V], b[V];
    int place[V];
    STORE_VECTOR(t, 0, rest);
    STORE_VECTOR(red[row] + t * background_red, 0, r);
    STORE_VECTOR(green[row] + t * background_green, 0, g);
    STORE_VECTOR(blue[row] + t * background_blue, 0, b);
    STORE_VECTOR(convert_int16(last[row]), 0, place);
    const long pixel = (long)(tile.top + row) * width + tile.left;
    for (int column = 0; column < tile.columns; ++column) {
      color[(pixel + column) * 3] = r[column];
      color[(pixel + column) * 3 + 1] = g[column];
      color[(pixel + column) * 3 + 2] = b[column];
      alpha[pixel + column] = 1 - rest[column];
      transmittance[pixel + column] = rest[column];
      contributors[pixel + column] = place[column];
    }
  }
}

// Adds neighbours: the lanes of a in the lower half, of b in the upper. Four rounds over 16 vectors leave the sum of
// each.
inline REALV fold(const REALV a, const REALV b) { return (REALV)(a.even, b.even) + (REALV)(a.odd, b.odd); }

kernel void raster_backward(global const REAL* records, global const uint* tile_starts, global const uint* order,
                            global const uint* slot_splats, global const REAL* transmittance,
                            global const int* contributors, global const REAL* d_color, global const REAL* d_alpha,
                            global REAL* slots, const REAL background_red, const REAL background_green,
                            const REAL background_blue, const int width, const int height) {
  const int tile_index = get_global_id(0);
  const Tile tile = tile_at(tile_index, width, height);
  const REALV x = CENTERS;
  // behind: what the splats behind and the background are worth, as the loss weighs colours (d_color . colour +
  // d_alpha).
  REALV left_over[TILE_HEIGHT], behind[TILE_HEIGHT], d_red[TILE_HEIGHT], d_green[TILE_HEIGHT], d_blue[TILE_HEIGHT],
      d_opaque[TILE_HEIGHT];
  MASKV last[TILE_HEIGHT];
  uint row_end[TILE_HEIGHT];
  const uint begin = tile_starts[tile_index], end = tile_starts[tile_index + 1];
  uint used_end = begin;
  for (int row = 0; row < tile.rows; ++row) {
    const long pixel = (long)(tile.top + row) * width + tile.left;
    REAL rest[V], r[V], g[V], b[V], o[V];
    int place[V];
    int largest = 0;
    for (int column = 0; column < V; ++column) {
      const int inside = column < tile.columns;
      const long p = inside ? pixel + column : pixel;
      rest[column] = transmittance[p];
      r[column] = inside ? d_color[p * 3] : 0;
      g[column] = inside ? d_color[p * 3 + 1] : 0;
      b[column] = inside ? d_color[p * 3 + 2] : 0;
      o[column] = inside ? d_alpha[p] : 0;
      place[column] = inside ? contributors[p] : 0;
      largest = max(largest, place[column]);
    }
    left_over[row] = LOAD_VECTOR(0, rest);
    d_red[row] = LOAD_VECTOR(0, r);
    d_green[row] = LOAD_VECTOR(0, g);
    d_blue[row] = LOAD_VECTOR(0, b);
    d_opaque[row] = LOAD_VECTOR(0, o);
#if REAL_IS_DOUBLE
    last[row] = convert_long16(LOAD_VECTOR(0, place));
#else
    last[row] = LOAD_VECTOR(0, place);
#endif
    behind[row] = d_red[row] * background_red + d_green[row] * background_green + d_blue[row] * background_blue;
    row_end[row] = (uint)largest;
    used_end = max(used_end, (uint)largest);
  }

  for (uint i = used_end; i < end; ++i) STORE_VECTOR((REALV)0, (long)order[i], slots);
  REAL record[RECORD_SIZE];
  REALV next = used_end > begin ? record_in_place(records, slot_splats, order[used_end - 1]) : (REALV)0;
  for (uint i = used_end; i-- > begin;) {
    const uint slot = order[i];
    STORE_VECTOR(next, 0, record);
    if (i > begin) next = record_in_place(records, slot_splats, order[i - 1]);
    const TileSplat splat = tile_splat(record, tile);
    const REAL splat_red = record[RECORD_COLOR], splat_green = record[RECORD_COLOR + 1],
               splat_blue = record[RECORD_COLOR + 2];
    REALV w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0, wyy = 0, sum_red = 0, sum_green = 0, sum_blue = 0;
    RowGaussians rows;
    row_gaussians(splat, x, &rows);
    const REALV scaled_x = x * splat.sharpness_x;
    for (int row = splat.first_row; row <= splat.last_row; ++row) {
      if (i >= row_end[row]) continue;
      const REALV exponent = row_exponent(&rows, row, scaled_x);
      const REALV plain = exp2_in_range(exponent);
      REALV a = fmin(plain, ALPHA_MAX);
      const MASKV taken = exponent >= LOG2_ALPHA_MIN && last[row] > (MASKV)(int)i;
#if SMOOTH_CUTOFF
      const REALV slope = plain < ALPHA_MAX ? fade_slope(a) : (REALV)0;
      a *= fade(a);
      a = taken ? a : (REALV)0;
      const REALV by_exponent = taken ? slope : (REALV)0;
#else
      a = taken ? a : (REALV)0;
      const REALV by_exponent = plain < ALPHA_MAX ? a : (REALV)0;
#endif
      const REALV t = left_over[row] / (1 - a);
      left_over[row] = t;
      const REALV worth =
          d_red[row] * splat_red + d_green[row] * splat_green + d_blue[row] * splat_blue + d_opaque[row];
      const REALV gain = worth - behind[row];
      behind[row] += a * gain;
      const REALV weight = a * t;
      sum_red += weight * d_red[row];
      sum_green += weight * d_green[row];
      sum_blue += weight * d_blue[row];
      const REALV d_exponent = by_exponent * t * gain;
      const REALV dx = x - splat.u;
      const REALV d_exponent_x = d_exponent * dx;
      w += d_exponent;
      wx += d_exponent_x;
      wy += d_exponent * rows.dy[row];
      wxx += d_exponent_x * dx;
      wxy += d_exponent_x * rows.dy[row];
      wyy += d_exponent * (rows.dy[row] * rows.dy[row]);
    }
    const REALV first = fold(fold(fold(w, wx), fold(wy, wxx)), fold(fold(wxy, wyy), fold(sum_red, sum_green)));
    const REALV ninth = fold(sum_blue, sum_blue), second = fold(fold(ninth, ninth), fold(ninth, ninth));
    STORE_VECTOR(fold(first, second), (long)slot, slots);
  }
}
