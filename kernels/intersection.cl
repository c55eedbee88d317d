// Which tiles a projected splat touches: those with a pixel centre inside its ellipse alpha >= ALPHA_MIN (by the
// ellipse's exact reach within the tile's rows, grown by MARGIN for rounding), counted and then listed by one and the
// same function.
// -D TILE_WIDTH, TILE_HEIGHT: pixels of a tile.
// Arrays: records (N,RECORD_SIZE); order (N): splats by (depth, index); slot_counts, slot_offsets (N); tile_keys,
// slot_splats (M): one entry per intersection, numbered front to back by splat; tile_starts (tiles + 1).
// Launch: one item per splat, intersection or tile; local size free. Deterministic: every element has one writer.
#include "common/real.cl"
#include "common/splat.cl"

// Counting and listing must round alike wherever the compiler inlines them.
#pragma OPENCL FP_CONTRACT OFF

#define MARGIN ((REAL)0.01)

typedef struct {
  int first, last;
} Span;

// Tiles of `size` pixels that hold a pixel centre of [low, high], of `pixels` pixels in all; empty when first > last.
// Bounds beyond the image are cut before they become integers.
inline Span tiles_between(const REAL low, const REAL high, const int size, const int pixels) {
  const int first = (int)ceil(fmin(fmax(low - MARGIN - (REAL)0.5, (REAL)0), (REAL)pixels));
  const int last = (int)floor(fmin(fmax(high + MARGIN - (REAL)0.5, (REAL)-1), (REAL)(pixels - 1)));
  const Span span = {first / size, first <= last ? last / size : first / size - 1};
  return span;
}

// Tile columns of the ellipse between the first and last pixel centres of a tile row. `box` is its reach over all rows,
// which is the answer already when it has but one row or one column.
inline Span columns_in_row(global const REAL* record, const Span rows, const Span box, const int row, const int width) {
  if (rows.first == rows.last || box.first >= box.last) return box;
  const REAL u = record[RECORD_U], v = record[RECORD_V], half_width = record[RECORD_WIDTH], tilt = record[RECORD_TILT];
  const REAL slope = record[RECORD_SLOPE], sharpness_x = record[RECORD_SHARPNESS_X],
             sharpness_y = record[RECORD_SHARPNESS_Y];
  const REAL reach = record[RECORD_LOG2_OPACITY] - LOG2_ALPHA_MIN;
  const REAL top = fmax(row * TILE_HEIGHT + (REAL)0.5 - v, -record[RECORD_HEIGHT]);
  const REAL bottom = fmin(row * TILE_HEIGHT + TILE_HEIGHT - (REAL)0.5 - v, record[RECORD_HEIGHT]);
  // The ellipse is widest to the right at d.y = tilt and to the left at -tilt; elsewhere its edge is monotonic.
  const REAL right_at = fmin(fmax(tilt, top), bottom), left_at = fmin(fmax(-tilt, top), bottom);
  const REAL half_right = sqrt(fmax(reach - sharpness_y * right_at * right_at, (REAL)0)) / sharpness_x;
  const REAL half_left = sqrt(fmax(reach - sharpness_y * left_at * left_at, (REAL)0)) / sharpness_x;
  const REAL right = right_at == tilt ? half_width : fmin(slope * right_at + half_right, half_width);
  const REAL left = left_at == -tilt ? -half_width : fmax(slope * left_at - half_left, -half_width);
  return tiles_between(u + left, u + right, TILE_WIDTH, width);
}

inline Span rows_of(global const REAL* record, const int height) {
  if (!(record[RECORD_WIDTH] >= 0)) {
    const Span none = {0, -1};
    return none;
  }
  return tiles_between(record[RECORD_V] - record[RECORD_HEIGHT], record[RECORD_V] + record[RECORD_HEIGHT], TILE_HEIGHT,
                       height);
}

inline Span columns_of(global const REAL* record, const int width) {
  return tiles_between(record[RECORD_U] - record[RECORD_WIDTH], record[RECORD_U] + record[RECORD_WIDTH], TILE_WIDTH,
                       width);
}

// slot_counts[splat] = how many tiles it touches.
kernel void count_tiles(global const REAL* records, global uint* slot_counts, const int width, const int height,
                        const long count) {
  const long splat = get_global_id(0);
  if (splat >= count) return;
  global const REAL* record = records + splat * RECORD_SIZE;
  const Span rows = rows_of(record, height), box = columns_of(record, width);
  uint tiles = 0;
  for (int row = rows.first; row <= rows.last; ++row) {
    const Span columns = columns_in_row(record, rows, box, row, width);
    tiles += (uint)max(columns.last - columns.first + 1, 0);
  }
  slot_counts[splat] = tiles;
}

// Between the order of the splats and their order by depth: sorted[rank] = values[order[rank]], and back.
kernel void to_depth_order(global const uint* values, global const uint* order, global uint* sorted, const long count) {
  const long rank = get_global_id(0);
  if (rank < count) sorted[rank] = values[order[rank]];
}
kernel void from_depth_order(global const uint* sorted, global const uint* order, global uint* values,
                             const long count) {
  const long rank = get_global_id(0);
  if (rank < count) values[order[rank]] = sorted[rank];
}

// From slot_offsets[splat] on: the tiles of the splat, row by row.
kernel void list_tiles(global const REAL* records, global const uint* slot_offsets, global uint* tile_keys,
                       global uint* slot_splats, const int width, const int height, const long count) {
  const long splat = get_global_id(0);
  if (splat >= count) return;
  global const REAL* record = records + splat * RECORD_SIZE;
  const Span rows = rows_of(record, height), box = columns_of(record, width);
  const int grid_columns = (width + TILE_WIDTH - 1) / TILE_WIDTH;
  uint slot = slot_offsets[splat];
  for (int row = rows.first; row <= rows.last; ++row) {
    const Span columns = columns_in_row(record, rows, box, row, width);
    for (int column = columns.first; column <= columns.last; ++column) {
      tile_keys[slot] = (uint)(row * grid_columns + column);
      slot_splats[slot] = (uint)splat;
      ++slot;
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
