// A tile of 16x16 pixels as raster_wide.cl sees it: 4x4 blocks of 4x4 pixels, of which a vector holds one (row by row).
// Blocks are numbered row by row too, so that a vector can also hold a number for each block. Needs common/real.cl with
// V=16, common/splat.cl and common/columns.cl before it.

#define TILE_SIZE 16
#define BLOCKS 16
#if REAL_IS_DOUBLE
#define MASKV long16
#else
#define MASKV int16
#endif
#define TO_MASKV JOIN(convert_, MASKV)
// Columns and rows of the pixels of a block, and of the blocks of a tile.
#define ACROSS (REALV)(0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3)
#define LANES (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)
#define DOWN (REALV)(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3)

typedef struct {
  int left, top, columns, rows;  // first pixel and size within the image
} Tile;

inline Tile tile_at(const int index, const int width, const int height) {
  const int grid_columns = (width + TILE_SIZE - 1) / TILE_SIZE;
  Tile tile;
  tile.left = index % grid_columns * TILE_SIZE;
  tile.top = index / grid_columns * TILE_SIZE;
  tile.columns = min(TILE_SIZE, width - tile.left);
  tile.rows = min(TILE_SIZE, height - tile.top);
  return tile;
}

// Up to BATCH splats in a tile, number by number: where the centres of the columns and of the rows of blocks lie from
// the splat, what s and t (common/splat.cl) gain per pixel, and which blocks the splat may reach: by block a byte a
// splat, 0 or 255, and by splat a bit a block.
#define BATCH 64
typedef struct {
  REAL x[4][BATCH], y[4][BATCH];
  REAL s_by_x[BATCH], s_by_y[BATCH], t_by_y[BATCH], peak[BATCH], red[BATCH], green[BATCH], blue[BATCH];
  uchar reaches[BLOCKS][BATCH] __attribute__((aligned(8)));
  int blocks[BATCH];
} Batch;

// Fills `batch` with entries first .. first + size - 1. Only splats of a number below block_ends[block] reach a block.
inline void place_in_tile(global const REAL* records, global const uint2* entries, const int first, const int size,
                          const Tile tile, const int block_ends[BLOCKS], Batch* batch) {
  for (int start = 0; start < size; start += V) {
    REALV fields[RECORD_SIZE];
    for (int k = 0; k < V; ++k) {
      fields[k] = LOAD_VECTOR((long)entries[first + min(start + k, size - 1)].x, records);
    }
    transpose_16(fields);
    const int16 number = LANES + start, entry = number + first;
    const REALV s_by_x = fields[RECORD_SHARPNESS_X], s_by_y = -s_by_x * fields[RECORD_SLOPE],
                t_by_y = fields[RECORD_SHARPNESS_Y], reach = fields[RECORD_BLOCK_REACH],
                square = fields[RECORD_BLOCK_RADIUS] * fields[RECORD_BLOCK_RADIUS];
    STORE_VECTOR(s_by_x, 0, batch->s_by_x + start);
    STORE_VECTOR(s_by_y, 0, batch->s_by_y + start);
    STORE_VECTOR(t_by_y, 0, batch->t_by_y + start);
    STORE_VECTOR(fields[RECORD_LOG2_OPACITY], 0, batch->peak + start);
    STORE_VECTOR(fields[RECORD_COLOR], 0, batch->red + start);
    STORE_VECTOR(fields[RECORD_COLOR + 1], 0, batch->green + start);
    STORE_VECTOR(fields[RECORD_COLOR + 2], 0, batch->blue + start);
    int16 blocks = 0;
    for (int column = 0; column < 4; ++column) {
      STORE_VECTOR(tile.left + 4 * column + 2 - fields[RECORD_U], 0, batch->x[column] + start);
    }
    for (int row = 0; row < 4; ++row) {
      const REALV y = tile.top + 4 * row + 2 - fields[RECORD_V], t = t_by_y * y, row_s = s_by_y * y;
      const MASKV row_reached = fabs(y) <= fields[RECORD_HEIGHT] + 2 && TO_MASKV(number < size);
      STORE_VECTOR(y, 0, batch->y[row] + start);
      for (int column = 0; column < 4; ++column) {
        const int block = 4 * row + column;
        const REALV x = LOAD_VECTOR(0, batch->x[column] + start), s = row_s + s_by_x * x;
        const int16 reached = convert_int16(row_reached && fabs(x) <= fields[RECORD_WIDTH] + 2 && fabs(s) <= reach &&
                                            s * s + t * t <= square) && entry < block_ends[block];
        vstore16(convert_uchar16(as_uint16(reached)), 0, batch->reaches[block] + start);
        blocks |= reached & 1 << block;
      }
    }
    vstore16(blocks, 0, batch->blocks + start);
  }
}

// The splats of a batch of `size` that reach a block, a bit each. A product moves a bit of every byte to the top one.
inline ulong splats_of(const Batch* batch, const int block, const int size) {
  const ulong8 bytes = vload8(0, (const ulong*)batch->reaches[block]) & (ulong8)(0x8040201008040201ul);
  const uchar8 bits = convert_uchar8(bytes * (ulong8)(0x0101010101010101ul) >> (ulong8)(56));
  return as_ulong(bits) & ~0ul >> (BATCH - size);
}

// log2(alpha) of splat k of a batch in a block's pixels, and their s and t.
inline REALV exponent_in_block(const Batch* batch, const int k, const int block, REALV* s, REALV* t) {
  const REALV x = batch->x[block % 4][k] + (ACROSS - (REAL)1.5), y = batch->y[block / 4][k] + (DOWN - (REAL)1.5);
  *s = batch->s_by_x[k] * x + batch->s_by_y[k] * y;
  *t = batch->t_by_y[k] * y;
  return batch->peak[k] - *s * *s - *t * *t;
}

// Whether a pixel takes further splats.
inline bool is_open(const REALV left_over) {
  const ulong2 bytes = as_ulong2(convert_char16(left_over >= TRANSMITTANCE_MIN));
  return (bytes.x | bytes.y) != 0;
}

// Where a row of the tile's pixels starts within its blocks: four numbers here, four in the next block ...
inline int row_start(const int row) { return row / 4 * (4 * V) + row % 4 * 4; }

inline REALV row_of_blocks(const REALV* blocks, const int row) {
  const REAL* p = (const REAL*)blocks + row_start(row);
  return (REALV)(vload4(0, p), vload4(0, p + V), vload4(0, p + 2 * V), vload4(0, p + 3 * V));
}

inline int16 row_of_int_blocks(const int16* blocks, const int row) {
  const int* p = (const int*)blocks + row_start(row);
  return (int16)(vload4(0, p), vload4(0, p + V), vload4(0, p + 2 * V), vload4(0, p + 3 * V));
}

inline void row_to_blocks(const REALV values, REALV* blocks, const int row) {
  REAL* p = (REAL*)blocks + row_start(row);
  vstore4(values.s0123, 0, p);
  vstore4(values.s4567, 0, p + V);
  vstore4(values.s89ab, 0, p + 2 * V);
  vstore4(values.scdef, 0, p + 3 * V);
}

inline void int_row_to_blocks(const int16 values, int16* blocks, const int row) {
  int* p = (int*)blocks + row_start(row);
  vstore4(values.s0123, 0, p);
  vstore4(values.s4567, 0, p + V);
  vstore4(values.s89ab, 0, p + 2 * V);
  vstore4(values.scdef, 0, p + 3 * V);
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
