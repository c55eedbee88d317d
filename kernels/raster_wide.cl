// Rasterisation of projected splats for wide vectors: one item composites a tile, REALV is a block of 4x4 pixels, no
// barrier. Of the tile's blocks a splat visits those that its ellipse reaches, unless all their pixels are opaque: of
// 16 pixels side by side a splat of common size would cover fewer. Lists are taken in batches, whose blocks are known
// before the first is visited: a branch that waits for them would cost as much as two blocks. Backward walks the same
// lists from the last contributor to the front and stores the sums of a splat over the tile into the slot of that
// intersection. Records and slots lie anywhere in memory: they are called for a batch, or AHEAD splats, before their
// use.
// -D V=16; SMOOTH_CUTOFF=0|1: alpha fades in between ALPHA_MIN and 2 ALPHA_MIN instead of stepping (for finite
// differences).
// Arrays: records (views N,RECORD_SIZE), tile_starts (tiles+1), entries (M) uint2: splat and slot, by tile, color
// (H,W,3), alpha (H,W), transmittance (H,W): what is left behind the last contributor, contributors (H,W): place in
// `entries` of the pixel's last contributor, plus one, slots (M,SLOT_SIZE).
// Launch: one item per tile of 16x16 pixels, local size 1. Deterministic: every element has one writer.
#include "common/real.cl"
#include "common/splat.cl"
#include "common/prefetch.cl"
#include "common/columns.cl"
#include "common/raster_tile.cl"

#define AHEAD 8

inline void prefetch_records(global const REAL* records, global const uint2* entries, const int first, const int end) {
  for (int i = first; i < min(first + BATCH, end); ++i) PREFETCH(records + (long)entries[i].x * RECORD_SIZE);
}

kernel void raster_forward(global const REAL* records, global const uint* tile_starts, global const uint2* entries,
                           global REAL* color, global REAL* alpha, global REAL* transmittance,
                           global int* contributors, const REAL background_red, const REAL background_green,
                           const REAL background_blue, const int width, const int height, const int first_tile) {
  const int tile_index = get_global_id(0);
  const Tile tile = tile_at(tile_index, width, height);
  const int begin = tile_starts[first_tile + tile_index], end = tile_starts[first_tile + tile_index + 1];
  REALV left_over[BLOCKS], red[BLOCKS], green[BLOCKS], blue[BLOCKS];
  int16 last[BLOCKS];
  for (int block = 0; block < BLOCKS; ++block) {
    // Pixels outside the image are opaque from the start.
    const REALV x = ACROSS + 4 * (block % 4), y = DOWN + 4 * (block / 4);
    left_over[block] = x < tile.columns && y < tile.rows ? (REALV)1 : (REALV)0;
    red[block] = green[block] = blue[block] = 0;
    last[block] = 0;
  }
  int open = 0;
  for (int block = 0; block < BLOCKS; ++block) open |= is_open(left_over[block]) << block;

  int no_ends[BLOCKS];
  for (int block = 0; block < BLOCKS; ++block) no_ends[block] = end;
  Batch batch;
  prefetch_records(records, entries, begin, end);
  for (int start = begin; start < end && open; start += BATCH) {
    const int size = min(end - start, BATCH);
    prefetch_records(records, entries, start + BATCH, end);
    place_in_tile(records, entries, start, size, tile, no_ends, &batch);
    // Block by block, so that what its pixels gather stays in registers.
    for (int rest = open; rest; rest &= rest - 1) {
      const int block = 31 - clz(rest & -rest);
      ulong splats = splats_of(&batch, block, size);
      if (!splats) continue;
      REALV left = left_over[block], r = red[block], g = green[block], b = blue[block];
      int16 place = last[block];
      for (; splats; splats &= splats - 1) {
        const int k = 63 - (int)clz(splats & -splats);
        REALV s, t;
        const REALV exponent = exponent_in_block(&batch, k, block, &s, &t);
        REALV a = fmin(exp2_in_range(exponent), ALPHA_MAX);
#if SMOOTH_CUTOFF
        a *= fade(a);
#endif
        const MASKV taken = exponent >= LOG2_ALPHA_MIN && left >= TRANSMITTANCE_MIN;
        const REALV weight = taken ? a * left : (REALV)0;
        r += weight * batch.red[k];
        g += weight * batch.green[k];
        b += weight * batch.blue[k];
        left -= weight;
        place = convert_int16(taken) ? (int16)(start + k + 1) : place;
      }
      left_over[block] = left;
      red[block] = r;
      green[block] = g;
      blue[block] = b;
      last[block] = place;
      if (!is_open(left)) open &= ~(1 << block);
    }
  }

  for (int row = 0; row < tile.rows; ++row) {
    const REALV left = row_of_blocks(left_over, row);
    const REALV r = row_of_blocks(red, row) + left * background_red,
                g = row_of_blocks(green, row) + left * background_green,
                b = row_of_blocks(blue, row) + left * background_blue;
    const int16 place = row_of_int_blocks(last, row);
    const long pixel = (long)(tile.top + row) * width + tile.left;
    if (tile.columns == V) {
      store_rows_of_3(r, g, b, color + pixel * 3);
      STORE_VECTOR(1 - left, 0, alpha + pixel);
      STORE_VECTOR(left, 0, transmittance + pixel);
      vstore16(place, 0, contributors + pixel);
      continue;
    }
    REAL rest[V], reds[V], greens[V], blues[V];
    int places[V];
    STORE_VECTOR(left, 0, rest);
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

// What a row of a tile's pixels leaves for the way back; zeros outside the image.
typedef struct {
  REALV left_over, d_color[3], d_alpha;
  int16 last;
} PixelRow;

inline PixelRow row_at(const Tile tile, const int row, global const REAL* transmittance, global const int* contributors,
                       global const REAL* d_color, global const REAL* d_alpha, const int width) {
  const long pixel = (long)(tile.top + row) * width + tile.left;
  PixelRow p;
  if (row < tile.rows && tile.columns == V) {
    load_rows_of_3(d_color + pixel * 3, p.d_color);
    p.d_alpha = LOAD_VECTOR(0, d_alpha + pixel);
    p.left_over = LOAD_VECTOR(0, transmittance + pixel);
    p.last = vload16(0, contributors + pixel);
    return p;
  }
  REAL values[5][V];
  int places[V];
  for (int column = 0; column < V; ++column) {
    const int inside = row < tile.rows && column < tile.columns;
    const long at = inside ? pixel + column : 0;
    for (int c = 0; c < 3; ++c) values[c][column] = inside ? d_color[at * 3 + c] : 0;
    values[3][column] = inside ? d_alpha[at] : 0;
    values[4][column] = inside ? transmittance[at] : 0;
    places[column] = inside ? contributors[at] : 0;
  }
  for (int c = 0; c < 3; ++c) p.d_color[c] = LOAD_VECTOR(0, values[c]);
  p.d_alpha = LOAD_VECTOR(0, values[3]);
  p.left_over = LOAD_VECTOR(0, values[4]);
  p.last = vload16(0, places);
  return p;
}

kernel void raster_backward(global const REAL* records, global const uint* tile_starts, global const uint2* entries,
                            global const REAL* transmittance, global const int* contributors,
                            global const REAL* d_color, global const REAL* d_alpha, global REAL* slots,
                            const REAL background_red, const REAL background_green, const REAL background_blue,
                            const int width, const int height, const int first_tile) {
  const int tile_index = get_global_id(0);
  const Tile tile = tile_at(tile_index, width, height);
  const int begin = tile_starts[first_tile + tile_index], end = tile_starts[first_tile + tile_index + 1];
  // behind: what the splats behind and the background are worth, as the loss weighs colours (d_color . colour +
  // d_alpha).
  REALV left_over[BLOCKS], behind[BLOCKS], d_red[BLOCKS], d_green[BLOCKS], d_blue[BLOCKS], d_opaque[BLOCKS];
  int16 last[BLOCKS];
  for (int row = 0; row < TILE_SIZE; ++row) {
    const PixelRow p = row_at(tile, row, transmittance, contributors, d_color, d_alpha, width);
    row_to_blocks(p.left_over, left_over, row);
    row_to_blocks(p.d_color[0], d_red, row);
    row_to_blocks(p.d_color[1], d_green, row);
    row_to_blocks(p.d_color[2], d_blue, row);
    row_to_blocks(p.d_alpha, d_opaque, row);
    int_row_to_blocks(p.last, last, row);
  }
  int block_ends[BLOCKS], used_end = begin;
  for (int block = 0; block < BLOCKS; ++block) {
    behind[block] = d_red[block] * background_red + d_green[block] * background_green + d_blue[block] * background_blue;
    const int8 larger = max(last[block].lo, last[block].hi);
    const int4 largest = max(larger.lo, larger.hi);
    block_ends[block] = max(max(largest.x, largest.y), max(largest.z, largest.w));
    used_end = max(used_end, block_ends[block]);
  }

  for (int i = used_end; i < end; ++i) STORE_VECTOR((REALV)0, (long)entries[i].y, slots);
  Batch batch;
  prefetch_records(records, entries, max(used_end - BATCH, begin), used_end);
  for (int stop = used_end; stop > begin; stop -= BATCH) {
    const int start = max(stop - BATCH, begin);
    prefetch_records(records, entries, max(start - BATCH, begin), start);
    place_in_tile(records, entries, start, stop - start, tile, block_ends, &batch);
    for (int k = stop - start; k-- > 0;) {
      const int i = start + k;
      PREFETCH_WRITE(slots + (long)entries[max(i - AHEAD, begin)].y * SLOT_SIZE);
      // Sums over the blocks, still apart by pixel of the block.
      REALV w = 0, ws = 0, wt = 0, wss = 0, wst = 0, wtt = 0, sum_red = 0, sum_green = 0, sum_blue = 0;
      for (int blocks = batch.blocks[k]; blocks; blocks &= blocks - 1) {
        const int block = 31 - clz(blocks & -blocks);
        REALV s, t;
        const REALV exponent = exponent_in_block(&batch, k, block, &s, &t);
        const REALV plain = exp2_in_range(exponent);
        REALV a = fmin(plain, ALPHA_MAX);
        const MASKV taken = exponent >= LOG2_ALPHA_MIN && TO_MASKV(last[block] > i);
#if SMOOTH_CUTOFF
        const REALV slope = fade_slope(a);
        a *= fade(a);
#endif
        a = taken ? a : (REALV)0;
        const REALV left = left_over[block] / (1 - a);
        left_over[block] = left;
        const REALV worth = d_red[block] * batch.red[k] + d_green[block] * batch.green[k] +
                            d_blue[block] * batch.blue[k] + d_opaque[block];
        const REALV gain = worth - behind[block];
        behind[block] += a * gain;
        const REALV weight = a * left;
        sum_red += weight * d_red[block];
        sum_green += weight * d_green[block];
        sum_blue += weight * d_blue[block];
#if SMOOTH_CUTOFF
        const REALV by_exponent = taken ? slope * left : (REALV)0;
#else
        const REALV by_exponent = weight;
#endif
        const REALV d_exponent = plain < ALPHA_MAX ? by_exponent * gain : (REALV)0;
        const REALV by_s = d_exponent * s, by_t = d_exponent * t;
        w += d_exponent;
        ws += by_s;
        wt += by_t;
        wss += by_s * s;
        wst += by_s * t;
        wtt += by_t * t;
      }
      const REALV even = fold_pairs(fold_quarters(fold_halves(w, sum_blue), fold_halves(wst, 0)),
                                    fold_quarters(fold_halves(wt, 0), fold_halves(sum_red, 0)));
      const REALV odd = fold_pairs(fold_quarters(fold_halves(ws, 0), fold_halves(wtt, 0)),
                                   fold_quarters(fold_halves(wss, 0), fold_halves(sum_green, 0)));
      STORE_VECTOR(fold_neighbours(even, odd), (long)entries[i].y, slots);
    }
  }
}
