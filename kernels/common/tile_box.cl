// The tiles of a splat as a uint4: bits of 8x8 tiles row by row (x: the upper four rows, y: the lower four), number of
// the first of them, columns of the view's grid. Larger splats have LARGE_BOX in place of the first tile, and no bits.
// Needs common/tiles.cl before it.
#define BOX_SIZE 8
#define LARGE_BOX 0xFFFFFFFFu

inline int is_large(const uint4 box) { return box.z == LARGE_BOX; }

inline ulong tiles_of_box(const uint4 box) { return upsample(box.y, box.x); }

// The tile of the lowest bit of `tiles`.
inline uint first_tile_of(const uint4 box, const ulong tiles) {
  const uint bit = 63 - (uint)clz(tiles & -tiles);
  return box.z + bit / BOX_SIZE * box.w + bit % BOX_SIZE;
}

// The boxes of V splats; lanes past `lanes` are not stored.
inline void store_tile_boxes(const Ellipses ellipses, global const View* view, global uint4* boxes, const int lanes) {
  const Spans rows = rows_of(&ellipses, view->height), columns = columns_of(&ellipses, view->width);
  const INTV size = max(rows.last - rows.first, columns.last - columns.first);
  int sizes[V], longest = 0;
  STORE_VECTOR(rows.last - rows.first + 1, 0, sizes);
  for (int lane = 0; lane < V; ++lane) longest = max(longest, sizes[lane]);
  INTV upper = 0, lower = 0;
  for (int row = 0; row < min(longest, BOX_SIZE); ++row) {
    const Spans touched = columns_in_row(&ellipses, rows, columns, rows.first + row, view->width);
    const INTV length = max(touched.last - touched.first + 1, (INTV)0);
    const INTV bits = (((INTV)1 << length) - 1) << (touched.first - columns.first + row % 4 * BOX_SIZE);
    upper |= row < 4 ? bits : (INTV)0;
    lower |= row < 4 ? (INTV)0 : bits;
  }
  const INTV first = view->first_tile + rows.first * view->grid_columns + columns.first;
  int uppers[V], lowers[V], firsts[V];
  STORE_VECTOR(size < BOX_SIZE ? upper : (INTV)0, 0, uppers);
  STORE_VECTOR(size < BOX_SIZE ? lower : (INTV)0, 0, lowers);
  STORE_VECTOR(size < BOX_SIZE ? first : (INTV)(int)LARGE_BOX, 0, firsts);
  for (int lane = 0; lane < lanes; ++lane) {
    boxes[lane] = (uint4)((uint)uppers[lane], (uint)lowers[lane], (uint)firsts[lane], (uint)view->grid_columns);
  }
}
