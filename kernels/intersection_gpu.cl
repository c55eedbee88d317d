// Lists the splats of each tile front to back, for GPUs: the tiles of each splat are counted and then listed by one and
// the same function, numbered in the order of depth; a stable sort by tile follows, and gather_entries.
// -D V=1; TILE_WIDTH, TILE_HEIGHT: pixels of a tile.
// Arrays: records (views N,RECORD_SIZE); views; order (views N): splats by (depth, number); sorted_counts,
// sorted_offsets (views N): tiles of the splat of that rank, and the sum before it; slots_of (views N) uint2: first
// slot and number of slots of each splat; slot_tiles, slot_splats (M); slot_order (M): slots by tile; entries (M)
// uint2: splat and slot; tile_starts (tiles + 1): a tile's part of entries.
// Launch: one item per rank, or per entry; local size free. Deterministic: every element has one writer.
#include "common/real.cl"
#include "common/splat.cl"
#include "common/view.cl"
#include "common/tiles.cl"

// sorted_counts[rank] = how many tiles the splat touches.
kernel void count_tiles(global const REAL* records, global const View* views, global const uint* order,
                        global uint* sorted_counts, const uint splats, const uint count) {
  const uint rank = get_global_id(0);
  if (rank >= count) return;
  const uint splat = order[rank];
  global const View* view = views + splat / splats;
  const Ellipses ellipse = ellipse_of(records + (long)splat * RECORD_SIZE);
  const Spans rows = rows_of(&ellipse, view->height), box = columns_of(&ellipse, view->width);
  uint tiles = 0;
  for (int row = rows.first; row <= rows.last; ++row) {
    const Spans columns = columns_in_row(&ellipse, rows, box, row, view->width);
    tiles += (uint)max(columns.last - columns.first + 1, 0);
  }
  sorted_counts[rank] = tiles;
}

// From sorted_offsets[rank] on: the tiles of the splat, row by row.
kernel void list_tiles(global const REAL* records, global const View* views, global const uint* order,
                       global const uint* sorted_counts, global const uint* sorted_offsets, global uint* slot_tiles,
                       global uint* slot_splats, global uint2* slots_of, const uint splats, const uint count) {
  const uint rank = get_global_id(0);
  if (rank >= count) return;
  const uint splat = order[rank];
  global const View* view = views + splat / splats;
  uint slot = sorted_offsets[rank];
  slots_of[splat] = (uint2)(slot, sorted_counts[rank]);
  const Ellipses ellipse = ellipse_of(records + (long)splat * RECORD_SIZE);
  const Spans rows = rows_of(&ellipse, view->height), box = columns_of(&ellipse, view->width);
  for (int row = rows.first; row <= rows.last; ++row) {
    const Spans columns = columns_in_row(&ellipse, rows, box, row, view->width);
    for (int column = columns.first; column <= columns.last; ++column, ++slot) {
      slot_tiles[slot] = (uint)(view->first_tile + row * view->grid_columns + column);
      slot_splats[slot] = splat;
    }
  }
}

// Also tile_starts[t] = how many of the slots are of tiles below t, for t = 0 .. tiles. One item more than slots.
kernel void gather_entries(global const uint* slot_tiles, global const uint* slot_splats,
                           global const uint* slot_order, global uint2* entries, global uint* tile_starts,
                           const uint tiles, const uint count) {
  const uint i = get_global_id(0);
  if (i > count) return;
  const uint slot = i < count ? slot_order[i] : 0;
  if (i < count) entries[i] = (uint2)(slot_splats[slot], slot);
  const uint first = i > 0 ? slot_tiles[slot_order[i - 1]] + 1 : 0, last = i < count ? slot_tiles[slot] : tiles;
  for (uint tile = first; tile <= last; ++tile) tile_starts[tile] = i;
}
