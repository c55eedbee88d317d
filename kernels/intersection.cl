// Which tiles a projected splat touches: those with a pixel centre inside its ellipse alpha >= ALPHA_MIN (by the
// ellipse's exact reach within the tile's rows, grown by MARGIN for rounding), counted and then listed by one and the
// same function.
// -D TILE_WIDTH, TILE_HEIGHT: pixels of a tile.
// Arrays: records (N,RECORD_SIZE); order (N): splats by (depth, index); sorted_counts, sorted_offsets (N): tiles of the
// splat of that rank, and the sum before it; slot_counts, slot_offsets (N): the same by splat; tile_keys, slot_splats
// (M): one entry per intersection, numbered front to back by splat; tile_starts (tiles + 1).
// Launch: one item per V ranks, or per tile; local size free. Deterministic: every element has one writer.
#include "common/real.cl"
#include "common/splat.cl"
#include "common/prefetch.cl"

// Counting and listing must round alike wherever the compiler inlines them.
#pragma OPENCL FP_CONTRACT OFF

#define MARGIN ((REAL)0.01)
#define NOWHERE ((REAL)-1e6)
#define TO_REALV JOIN(convert_, REALV)
#define TO_INTV JOIN(convert_, INTV)

// What V splats have of their records; REACH is log2(opacity / ALPHA_MIN).
typedef struct {
  REALV u, v, sharpness_x, slope, sharpness_y, reach, width, height, tilt;
} Ellipses;

typedef struct {
  INTV first, last;
} Spans;

inline global const REAL* record_of_rank(global const REAL* records, global const uint* order, const long rank) {
  return records + (long)order[rank] * RECORD_SIZE;
}

// Of the splats from rank `first` on; lanes past the end repeat the last one. Culled splats lie outside the image.
inline Ellipses ellipses_at(global const REAL* records, global const uint* order, const long first, const long count) {
  REAL fields[RECORD_TILT + 1][V];
  for (int lane = 0; lane < V; ++lane) {
    // Records lie in the order of the splats: those of the next item are called for while these are used.
    PREFETCH(record_of_rank(records, order, min(first + V + lane, count - 1)));
    global const REAL* record = record_of_rank(records, order, min(first + lane, count - 1));
    for (int field = 0; field <= RECORD_TILT; ++field) fields[field][lane] = record[field];
  }
#define FIELD(field) LOAD_VECTOR(0, fields[field])
  Ellipses e = {FIELD(RECORD_U),      FIELD(RECORD_V),           FIELD(RECORD_SHARPNESS_X),
                FIELD(RECORD_SLOPE),  FIELD(RECORD_SHARPNESS_Y), FIELD(RECORD_LOG2_OPACITY) - LOG2_ALPHA_MIN,
                FIELD(RECORD_WIDTH),  FIELD(RECORD_HEIGHT),      FIELD(RECORD_TILT)};
  e.v = e.width >= 0 ? e.v : (REALV)NOWHERE;
  e.height = e.width >= 0 ? e.height : (REALV)0;
  return e;
}

// Tiles of `size` pixels that hold a pixel centre of [low, high], of `pixels` pixels in all; empty when first > last.
// Bounds beyond the image are cut before they become integers, by cutting off the fractions of positive numbers.
inline Spans tiles_between(const REALV low, const REALV high, const int size, const int pixels) {
  const REALV before = fmin(fmax(pixels - (low - MARGIN - (REAL)0.5), (REALV)0), (REALV)pixels);
  const REALV until = fmin(fmax(high + MARGIN + (REAL)0.5, (REALV)0), (REALV)pixels);
  const INTV first = pixels - TO_INTV(before), last = TO_INTV(until) - 1;
  const Spans spans = {first / size, first <= last ? last / size : first / size - 1};
  return spans;
}

// Tile columns of the ellipses between the first and last pixel centres of a tile row. `box` is their reach over all
// rows, which is the answer already when it has but one row or one column.
inline Spans columns_in_row(const Ellipses* e, const Spans rows, const Spans box, const INTV row, const int width) {
  const REALV center = TO_REALV(row * TILE_HEIGHT) - e->v;
  const REALV top = fmax(center + (REAL)0.5, -e->height);
  const REALV bottom = fmin(center + (TILE_HEIGHT - (REAL)0.5), e->height);
  // An ellipse is widest to the right at d.y = tilt and to the left at -tilt; elsewhere its edge is monotonic.
  const REALV right_at = fmin(fmax(e->tilt, top), bottom), left_at = fmin(fmax(-e->tilt, top), bottom);
  const REALV half_right = sqrt(fmax(e->reach - e->sharpness_y * right_at * right_at, (REALV)0)) / e->sharpness_x;
  const REALV half_left = sqrt(fmax(e->reach - e->sharpness_y * left_at * left_at, (REALV)0)) / e->sharpness_x;
  const REALV right = right_at == e->tilt ? e->width : fmin(e->slope * right_at + half_right, e->width);
  const REALV left = left_at == -e->tilt ? -e->width : fmax(e->slope * left_at - half_left, -e->width);
  const Spans exact = tiles_between(e->u + left, e->u + right, TILE_WIDTH, width);
  const INTV boxed = rows.first == rows.last || box.first >= box.last;
  const INTV present = row <= rows.last;
  const Spans spans = {boxed ? box.first : exact.first,
                       present ? (boxed ? box.last : exact.last) : (boxed ? box.first : exact.first) - 1};
  return spans;
}

inline Spans rows_of(const Ellipses* e, const int height) {
  return tiles_between(e->v - e->height, e->v + e->height, TILE_HEIGHT, height);
}

inline Spans columns_of(const Ellipses* e, const int width) {
  return tiles_between(e->u - e->width, e->u + e->width, TILE_WIDTH, width);
}

inline int longest(const Spans spans) {
  int lengths[V], most = 0;
  STORE_VECTOR(spans.last - spans.first + 1, 0, lengths);
  for (int lane = 0; lane < V; ++lane) most = max(most, lengths[lane]);
  return most;
}

// sorted_counts[rank] = how many tiles the splat touches.
kernel void count_tiles(global const REAL* records, global const uint* order, global uint* sorted_counts,
                        const int width, const int height, const long count) {
  const long first = get_global_id(0) * (long)V;
  if (first >= count) return;
  const Ellipses ellipses = ellipses_at(records, order, first, count);
  const Spans rows = rows_of(&ellipses, height), box = columns_of(&ellipses, width);
  const int most = longest(rows);
  INTV tiles = 0;
  for (int k = 0; k < most; ++k) {
    const Spans columns = columns_in_row(&ellipses, rows, box, rows.first + k, width);
    tiles += max(columns.last - columns.first + 1, (INTV)0);
  }
  STORE_VECTOR(tiles, 0, (global int*)sorted_counts + first);
}

// From sorted_offsets[rank] on: the tiles of the splat, row by row.
kernel void list_tiles(global const REAL* records, global const uint* order, global const uint* sorted_counts,
                       global const uint* sorted_offsets, global uint* tile_keys, global uint* slot_splats,
                       global uint* slot_counts, global uint* slot_offsets, const int width, const int height,
                       const long count) {
  const long first = get_global_id(0) * (long)V;
  if (first >= count) return;
  const int lanes = (int)min((long)V, count - first), grid_columns = (width + TILE_WIDTH - 1) / TILE_WIDTH;
  uint splats[V], slots[V];
  for (int lane = 0; lane < lanes; ++lane) {
    const uint next = order[min(first + V + lane, count - 1)];
    PREFETCH_WRITE(slot_offsets + next);
    PREFETCH_WRITE(slot_counts + next);
    splats[lane] = order[first + lane];
    slots[lane] = sorted_offsets[first + lane];
    slot_offsets[splats[lane]] = slots[lane];
    slot_counts[splats[lane]] = sorted_counts[first + lane];
  }
  const Ellipses ellipses = ellipses_at(records, order, first, count);
  const Spans rows = rows_of(&ellipses, height), box = columns_of(&ellipses, width);
  const int most = longest(rows);
  for (int k = 0; k < most; ++k) {
    const Spans columns = columns_in_row(&ellipses, rows, box, rows.first + k, width);
    int firsts[V], lasts[V], keys[V];
    STORE_VECTOR(columns.first, 0, firsts);
    STORE_VECTOR(columns.last, 0, lasts);
    STORE_VECTOR((rows.first + k) * grid_columns, 0, keys);
    for (int lane = 0; lane < lanes; ++lane) {
      for (int column = firsts[lane]; column <= lasts[lane]; ++column) {
        tile_keys[slots[lane]] = (uint)(keys[lane] + column);
        slot_splats[slots[lane]] = splats[lane];
        ++slots[lane];
      }
    }
  }
}

// tile_starts[t] = how many of the sorted keys are below t, for t = 0 .. tiles.
kernel void find_tile_starts(global const uint* sorted_keys, global uint* tile_starts, const int tiles,
                             const uint count) {
  const int tile = get_global_id(0);
  if (tile > tiles) return;
  uint low = 0, high = count;
  while (low < high) {
    const uint middle = low + (high - low) / 2;
    if (sorted_keys[middle] < (uint)tile) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  tile_starts[tile] = low;
}
