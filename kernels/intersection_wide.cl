// Lists the splats of each tile front to back, for CPUs: a counting sort of the splats in the order of depth, whose
// counters are the tiles. Few long chunks of that order each count their splats by tile, and then put them where the
// counts of all chunks say.
// -D V=16; TILE_WIDTH, TILE_HEIGHT: pixels of a tile.
// Arrays: boxes (views N) uint4: tiles of each splat (common/tile_box.cl); order (views N): splats by (depth, number);
// records (views N,RECORD_SIZE); views; tile_counts, cursors (chunks,tiles); chunk_totals (chunks) ulong: intersections
// of a chunk; tile_starts (tiles + 1): a tile's part of entries; entries (M) uint2: splat and slot; slots_of (views N)
// uint2: first slot and number of slots of each splat, in the order of depth.
// Launch: one item per chunk of `chunk_size` consecutive ranks; local size free. Deterministic: every element has one
// writer, and places in `entries` do not depend on how the order is cut into chunks.
#include "common/real.cl"
#include "common/splat.cl"
#include "common/prefetch.cl"
#include "common/view.cl"
#include "common/tiles.cl"
#include "common/tile_box.cl"

#define AHEAD 16
#define LANES (INTV)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)

// Counts a tile or, given entries, lists it. Returns the next slot.
inline uint visit_tile(const uint tile, global uint* cursors, global uint2* entries, const uint splat,
                       const uint slot) {
  const uint at = cursors[tile]++;
  if (entries) entries[at] = (uint2)(splat, slot);
  return slot + 1;
}

// The tiles of a splat that is too large for a box: V rows of tiles at a time.
uint visit_large(global const REAL* record, global const View* view, global uint* cursors, global uint2* entries,
                 const uint splat, uint slot) {
  const Ellipses ellipse = ellipse_of(record);
  const Spans rows = rows_of(&ellipse, view->height), box = columns_of(&ellipse, view->width);
  for (int first = rows.first.s0; first <= rows.last.s0; first += V) {
    const Spans columns = columns_in_row(&ellipse, rows, box, first + LANES, view->width);
    int firsts[V], lasts[V];
    STORE_VECTOR(columns.first, 0, firsts);
    STORE_VECTOR(columns.last, 0, lasts);
    for (int lane = 0; lane < V; ++lane) {
      const int row_start = view->first_tile + (first + lane) * view->grid_columns;
      for (int column = firsts[lane]; column <= lasts[lane]; ++column) {
        slot = visit_tile((uint)(row_start + column), cursors, entries, splat, slot);
      }
    }
  }
  return slot;
}

// Counts the tiles of a splat or, given entries, lists them. Returns the slot behind its last.
inline uint visit_tiles(const uint4 box, global const REAL* records, global const View* views, const uint splats,
                        global uint* cursors, global uint2* entries, const uint splat, uint slot) {
  if (is_large(box)) {
    return visit_large(records + (long)splat * RECORD_SIZE, views + splat / splats, cursors, entries, splat, slot);
  }
  for (ulong tiles = tiles_of_box(box); tiles; tiles &= tiles - 1) {
    slot = visit_tile(first_tile_of(box, tiles), cursors, entries, splat, slot);
  }
  return slot;
}

kernel void count_tiles(global const uint4* boxes, global const uint* order, global const REAL* records,
                        global const View* views, global uint* tile_counts, global ulong* chunk_totals,
                        const uint splats, const uint tiles, const uint chunk_size, const uint chunks,
                        const uint count) {
  const uint chunk = get_global_id(0);
  if (chunk >= chunks) return;
  global uint* counts = tile_counts + (long)chunk * tiles;
  for (uint tile = 0; tile < tiles; ++tile) counts[tile] = 0;
  const uint begin = chunk * chunk_size, end = min(begin + chunk_size, count);
  ulong total = 0;
  for (uint rank = begin; rank < end; ++rank) {
    PREFETCH(boxes + order[min(rank + AHEAD, end - 1)]);
    const uint splat = order[rank];
    total += visit_tiles(boxes[splat], records, views, splats, counts, 0, splat, 0);
  }
  chunk_totals[chunk] = total;
}

kernel void list_tiles(global const uint4* boxes, global const uint* order, global const REAL* records,
                       global const View* views, global const uint* tile_counts, global const ulong* chunk_totals,
                       global uint* all_cursors, global uint* tile_starts, global uint2* entries,
                       global uint2* slots_of, const uint splats, const uint tiles, const uint chunk_size,
                       const uint chunks, const uint count) {
  const uint chunk = get_global_id(0);
  if (chunk >= chunks) return;
  global uint* cursors = all_cursors + (long)chunk * tiles;
  uint start = 0;
  for (uint tile = 0; tile < tiles; ++tile) {
    if (chunk == 0) tile_starts[tile] = start;
    for (uint c = 0; c < chunks; ++c) {
      if (c == chunk) cursors[tile] = start;
      start += tile_counts[(long)c * tiles + tile];
    }
  }
  if (chunk == 0) tile_starts[tiles] = start;

  const uint begin = chunk * chunk_size, end = min(begin + chunk_size, count);
  uint slot = 0;
  for (uint c = 0; c < chunk; ++c) slot += (uint)chunk_totals[c];
  for (uint rank = begin; rank < end; ++rank) {
    const uint ahead = order[min(rank + AHEAD, end - 1)];
    PREFETCH(boxes + ahead);
    PREFETCH_WRITE(slots_of + ahead);
    const uint splat = order[rank];
    const uint behind = visit_tiles(boxes[splat], records, views, splats, cursors, entries, splat, slot);
    slots_of[splat] = (uint2)(slot, behind - slot);
    slot = behind;
  }
}
