// Rasterisation of projected splats for wide vectors: one item composites a tile, REALV is a row of 16 pixels, no
// barrier. A splat visits only the rows of the tile between its lowest and highest point, and rows whose pixels are all
// opaque are left out. Backward walks the same lists from the last contributor to the front and stores the sums of a
// splat over the tile into the slot of that intersection. Records and slots lie anywhere in memory: they are called for
// AHEAD splats before their use, without which the kernels wait for memory a third of their time.
// -D V=16; TILE_HEIGHT: rows of a tile, 1..16; SMOOTH_CUTOFF=0|1: alpha fades in between ALPHA_MIN and 2 ALPHA_MIN
// instead of stepping (for finite differences).
// Arrays: records (N,RECORD_SIZE), tile_starts (tiles+1), order (M): slots sorted by tile, slot_splats (M), color
// (H,W,3), alpha (H,W), transmittance (H,W): what is left behind the last contributor, contributors (H,W): place in
// `order` of the pixel's last contributor, plus one, slots (M,SLOT_SIZE).
// Launch: one item per tile, local size 1. Deterministic: every element has one writer.
#include "common/real.cl"
#include "common/splat.cl"
#include "common/prefetch.cl"
#include "common/columns.cl"

#define AHEAD 8
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

inline global const REAL* record_at(global const REAL* records, global const uint* slot_splats, const uint slot) {
  return records + (long)slot_splats[slot] * RECORD_SIZE;
}

// A splat in a tile: log2(alpha) = peak - (sharpness_x x - center)^2 along each row, dy the row's offset from (u, v);
// first .. last are the rows whose centres lie within its height, none when first > last.
typedef struct {
  REAL dy[V], center[V], peak[V];
  int first, last;
} TileSplat;

inline void place_in_tile(global const REAL* record, const Tile tile, const REALV row_centers, TileSplat* splat) {
  const REAL u = record[RECORD_U] - tile.left, v = record[RECORD_V] - tile.top, half_height = record[RECORD_HEIGHT];
  const REAL sharpness_x = record[RECORD_SHARPNESS_X];
  const REALV dy = row_centers - v;
  const REALV center = sharpness_x * (u + record[RECORD_SLOPE] * dy);
  const REALV peak = record[RECORD_LOG2_OPACITY] - record[RECORD_SHARPNESS_Y] * dy * dy;
  STORE_VECTOR(dy, 0, splat->dy);
  STORE_VECTOR(center, 0, splat->center);
  STORE_VECTOR(peak, 0, splat->peak);
  // Rounded up and down by cutting off the fractions of positive numbers, which costs next to nothing.
  const REAL above = fmin(fmax(v - half_height - (REAL)0.5, (REAL)0), (REAL)TILE_HEIGHT);
  splat->first = (int)above + (above > (int)above);
  splat->last = (int)fmin(fmax(v + half_height + (REAL)0.5, (REAL)0), (REAL)tile.rows) - 1;
}

// log2(alpha) along a row of pixels; scaled_x = sharpness_x x.
inline REALV row_exponent(const TileSplat* splat, const int row, const REALV scaled_x) {
  const REALV s = scaled_x - splat->center[row];
  return splat->peak[row] - s * s;
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
  for (uint i = begin; i < end; ++i) {
    PREFETCH(slot_splats + order[min(i + 2 * AHEAD, end - 1)]);
    PREFETCH(record_at(records, slot_splats, order[min(i + AHEAD, end - 1)]));
    global const REAL* record = record_at(records, slot_splats, order[i]);
    const REAL splat_red = record[RECORD_COLOR], splat_green = record[RECORD_COLOR + 1],
               splat_blue = record[RECORD_COLOR + 2];
    TileSplat splat;
    place_in_tile(record, tile, x, &splat);
    const REALV scaled_x = x * record[RECORD_SHARPNESS_X];
    for (int row = splat.first; row <= splat.last; ++row) {
      if (!open[row]) continue;
      const REALV exponent = row_exponent(&splat, row, scaled_x);
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
    const REALV r = red[row] + t * background_red, g = green[row] + t * background_green,
                b = blue[row] + t * background_blue;
    const int16 place = convert_int16(last[row]);
    const long pixel = (long)(tile.top + row) * width + tile.left;
    if (tile.columns == V) {
      store_rows_of_3(r, g, b, color + pixel * 3);
      STORE_VECTOR(1 - t, 0, alpha + pixel);
      STORE_VECTOR(t, 0, transmittance + pixel);
      vstore16(place, 0, contributors + pixel);
      continue;
    }
    REAL rest[V], reds[V], greens[V], blues[V];
    int places[V];
    STORE_VECTOR(t, 0, rest);
    STORE_VECTOR(r, 0, reds);
    STORE_VECTOR(g, 0, greens);
    STORE_VECTOR(b, 0, blues);
    vstore16(place, 0, places);
    for (int column = 0; column < tile.columns; ++column) {
      color[(pixel + column) * 3] = reds[column];
      color[(pixel + column) * 3 + 1] = greens[column];
      color[(pixel + column) * 3 + 2] = blues[column];
      alpha[pixel + column] = 1 - rest[column];
      transmittance[pixel + column] = rest[column];
      contributors[pixel + column] = places[column];
    }
  }
}

// Adds halves, quarters, pairs, neighbours: sums of a's lanes in one part, of b's in the other. Four rounds over 16
// vectors leave the sum of each; zeros cost nothing.
inline REALV fold_halves(const REALV a, const REALV b) { return (REALV)(a.lo, b.lo) + (REALV)(a.hi, b.hi); }
inline REALV fold_quarters(const REALV a, const REALV b) {
  return (REALV)(a.s0123, b.s0123, a.s89ab, b.s89ab) + (REALV)(a.s4567, b.s4567, a.scdef, b.scdef);
}
inline REALV fold_pairs(const REALV a, const REALV b) {
  return (REALV)(a.s01, b.s01, a.s45, b.s45, a.s89, b.s89, a.scd, b.scd) +
         (REALV)(a.s23, b.s23, a.s67, b.s67, a.sab, b.sab, a.sef, b.sef);
}
inline REALV fold_neighbours(const REALV a, const REALV b) {
  return (REALV)(a.s0, b.s0, a.s2, b.s2, a.s4, b.s4, a.s6, b.s6, a.s8, b.s8, a.sa, b.sa, a.sc, b.sc, a.se, b.se) +
         (REALV)(a.s1, b.s1, a.s3, b.s3, a.s5, b.s5, a.s7, b.s7, a.s9, b.s9, a.sb, b.sb, a.sd, b.sd, a.sf, b.sf);
}

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
    REALV d_rgb[3];
    int16 place;
    if (tile.columns == V) {
      load_rows_of_3(d_color + pixel * 3, d_rgb);
      d_opaque[row] = LOAD_VECTOR(0, d_alpha + pixel);
      left_over[row] = LOAD_VECTOR(0, transmittance + pixel);
      place = vload16(0, contributors + pixel);
    } else {
      REAL rest[V], r[V], g[V], b[V], o[V];
      int places[V];
      for (int column = 0; column < V; ++column) {
        const int inside = column < tile.columns;
        const long p = inside ? pixel + column : pixel;
        rest[column] = transmittance[p];
        r[column] = inside ? d_color[p * 3] : 0;
        g[column] = inside ? d_color[p * 3 + 1] : 0;
        b[column] = inside ? d_color[p * 3 + 2] : 0;
        o[column] = inside ? d_alpha[p] : 0;
        places[column] = inside ? contributors[p] : 0;
      }
      d_rgb[0] = LOAD_VECTOR(0, r);
      d_rgb[1] = LOAD_VECTOR(0, g);
      d_rgb[2] = LOAD_VECTOR(0, b);
      d_opaque[row] = LOAD_VECTOR(0, o);
      left_over[row] = LOAD_VECTOR(0, rest);
      place = vload16(0, places);
    }
    d_red[row] = d_rgb[0];
    d_green[row] = d_rgb[1];
    d_blue[row] = d_rgb[2];
#if REAL_IS_DOUBLE
    last[row] = convert_long16(place);
#else
    last[row] = place;
#endif
    behind[row] = d_red[row] * background_red + d_green[row] * background_green + d_blue[row] * background_blue;
    const int8 larger = max(place.lo, place.hi);
    const int4 largest = max(larger.lo, larger.hi);
    row_end[row] = (uint)max(max(largest.x, largest.y), max(largest.z, largest.w));
    used_end = max(used_end, row_end[row]);
  }

  for (uint i = used_end; i < end; ++i) {
    PREFETCH_WRITE(slots + (long)order[min(i + AHEAD, end - 1)] * SLOT_SIZE);
    STORE_VECTOR((REALV)0, (long)order[i], slots);
  }
  for (uint i = used_end; i-- > begin;) {
    const uint slot = order[i], slot_ahead = order[max(i, begin + AHEAD) - AHEAD];
    PREFETCH(slot_splats + order[max(i, begin + 2 * AHEAD) - 2 * AHEAD]);
    PREFETCH(record_at(records, slot_splats, slot_ahead));
    PREFETCH_WRITE(slots + (long)slot_ahead * SLOT_SIZE);
    global const REAL* record = record_at(records, slot_splats, slot);
    const REAL splat_red = record[RECORD_COLOR], splat_green = record[RECORD_COLOR + 1],
               splat_blue = record[RECORD_COLOR + 2];
    TileSplat splat;
    place_in_tile(record, tile, x, &splat);
    const REALV scaled_x = x * record[RECORD_SHARPNESS_X], dx = x - (record[RECORD_U] - tile.left);
    // The rows' sums of w, w dy, w dy^2 and of the colours, still apart by column.
    REALV w = 0, wy = 0, wyy = 0, sum_red = 0, sum_green = 0, sum_blue = 0;
    for (int row = splat.first; row <= splat.last; ++row) {
      if (i >= row_end[row]) continue;
      const REALV exponent = row_exponent(&splat, row, scaled_x);
      const REALV plain = exp2_in_range(exponent);
      REALV a = fmin(plain, ALPHA_MAX);
      const MASKV taken = exponent >= LOG2_ALPHA_MIN && last[row] > (MASKV)(int)i;
#if SMOOTH_CUTOFF
      const REALV slope = fade_slope(a);
      a *= fade(a);
#endif
      a = taken ? a : (REALV)0;
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
#if SMOOTH_CUTOFF
      const REALV by_exponent = taken ? slope * t : (REALV)0;
#else
      const REALV by_exponent = weight;
#endif
      const REALV d_exponent = plain < ALPHA_MAX ? by_exponent * gain : (REALV)0;
      w += d_exponent;
      wy += d_exponent * splat.dy[row];
      wyy += d_exponent * (splat.dy[row] * splat.dy[row]);
    }
    const REALV wx = w * dx, wxx = wx * dx, wxy = wy * dx;
    const REALV even = fold_pairs(fold_quarters(fold_halves(w, sum_blue), fold_halves(wxy, 0)),
                                  fold_quarters(fold_halves(wy, 0), fold_halves(sum_red, 0)));
    const REALV odd = fold_pairs(fold_quarters(fold_halves(wx, 0), fold_halves(wyy, 0)),
                                 fold_quarters(fold_halves(wxx, 0), fold_halves(sum_green, 0)));
    STORE_VECTOR(fold_neighbours(even, odd), (long)slot, slots);
  }
}
