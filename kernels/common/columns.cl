// Rows of three or four numbers, V at a time: between arrays of rows and one vector per column. V is 1 or 16; with 16
// the rows are read as whole vectors and their elements exchanged in registers. Needs common/real.cl before it.

#if V == 16
// Every third lane. Of three vectors one after the other, each begins at another remainder.
#define EVERY_THIRD_FROM_0(a) a.s0369, a.scf
#define EVERY_THIRD_FROM_1(a) a.s147a, a.sd
#define EVERY_THIRD_FROM_2(a) a.s258b, a.se
// The lanes of two vectors in turn.
#define MERGE_LOW(a, b) \
  (REALV)(a.s0, b.s0, a.s1, b.s1, a.s2, b.s2, a.s3, b.s3, a.s4, b.s4, a.s5, b.s5, a.s6, b.s6, a.s7, b.s7)
#define MERGE_HIGH(a, b) \
  (REALV)(a.s8, b.s8, a.s9, b.s9, a.sa, b.sa, a.sb, b.sb, a.sc, b.sc, a.sd, b.sd, a.se, b.se, a.sf, b.sf)
#endif

// columns[k], lane i = rows[3 i + k].
inline void load_rows_of_3(global const REAL* rows, REALV* columns) {
#if V == 1
  for (int k = 0; k < 3; ++k) columns[k] = rows[k];
#else
  const REALV a = LOAD_VECTOR(0, rows), b = LOAD_VECTOR(1, rows), c = LOAD_VECTOR(2, rows);
  columns[0] = (REALV)(EVERY_THIRD_FROM_0(a), EVERY_THIRD_FROM_2(b), EVERY_THIRD_FROM_1(c));
  columns[1] = (REALV)(EVERY_THIRD_FROM_1(a), EVERY_THIRD_FROM_0(b), EVERY_THIRD_FROM_2(c));
  columns[2] = (REALV)(EVERY_THIRD_FROM_2(a), EVERY_THIRD_FROM_1(b), EVERY_THIRD_FROM_0(c));
#endif
}

inline void store_rows_of_3(const REALV x, const REALV y, const REALV z, global REAL* rows) {
#if V == 1
  rows[0] = x;
  rows[1] = y;
  rows[2] = z;
#else
  // First x and y, with any lane where z goes; then z: compilers see exchanges of two vectors only.
  const REALV xy0 =
      (REALV)(x.s0, y.s0, x.s0, x.s1, y.s1, x.s0, x.s2, y.s2, x.s0, x.s3, y.s3, x.s0, x.s4, y.s4, x.s0, x.s5);
  const REALV xy1 =
      (REALV)(y.s5, x.s0, x.s6, y.s6, x.s0, x.s7, y.s7, x.s0, x.s8, y.s8, x.s0, x.s9, y.s9, x.s0, x.sa, y.sa);
  const REALV xy2 =
      (REALV)(x.s0, x.sb, y.sb, x.s0, x.sc, y.sc, x.s0, x.sd, y.sd, x.s0, x.se, y.se, x.s0, x.sf, y.sf, x.s0);
  STORE_VECTOR((REALV)(xy0.s01, z.s0, xy0.s34, z.s1, xy0.s67, z.s2, xy0.s9a, z.s3, xy0.scd, z.s4, xy0.sf), 0, rows);
  STORE_VECTOR((REALV)(xy1.s0, z.s5, xy1.s23, z.s6, xy1.s56, z.s7, xy1.s89, z.s8, xy1.sbc, z.s9, xy1.sef), 1, rows);
  STORE_VECTOR((REALV)(z.sa, xy2.s12, z.sb, xy2.s45, z.sc, xy2.s78, z.sd, xy2.sab, z.se, xy2.sde, z.sf), 2, rows);
#endif
}

// columns[k], lane i = rows[4 i + k].
inline void load_rows_of_4(global const REAL* rows, REALV* columns) {
#if V == 1
  for (int k = 0; k < 4; ++k) columns[k] = rows[k];
#else
  const REALV a = LOAD_VECTOR(0, rows), b = LOAD_VECTOR(1, rows), c = LOAD_VECTOR(2, rows), d = LOAD_VECTOR(3, rows);
  // Even and odd elements twice over.
  const REALV ab_even = (REALV)(a.even, b.even), cd_even = (REALV)(c.even, d.even);
  const REALV ab_odd = (REALV)(a.odd, b.odd), cd_odd = (REALV)(c.odd, d.odd);
  columns[0] = (REALV)(ab_even.even, cd_even.even);
  columns[1] = (REALV)(ab_odd.even, cd_odd.even);
  columns[2] = (REALV)(ab_even.odd, cd_even.odd);
  columns[3] = (REALV)(ab_odd.odd, cd_odd.odd);
#endif
}

inline void store_rows_of_4(const REALV w, const REALV x, const REALV y, const REALV z, global REAL* rows) {
#if V == 1
  rows[0] = w;
  rows[1] = x;
  rows[2] = y;
  rows[3] = z;
#else
  const REALV wy_low = MERGE_LOW(w, y), wy_high = MERGE_HIGH(w, y);
  const REALV xz_low = MERGE_LOW(x, z), xz_high = MERGE_HIGH(x, z);
  STORE_VECTOR(MERGE_LOW(wy_low, xz_low), 0, rows);
  STORE_VECTOR(MERGE_HIGH(wy_low, xz_low), 1, rows);
  STORE_VECTOR(MERGE_LOW(wy_high, xz_high), 2, rows);
  STORE_VECTOR(MERGE_HIGH(wy_high, xz_high), 3, rows);
#endif
}

// How many of the V rows from `first` on exist.
inline int lanes_from(const long first, const long count) { return (int)min((long)V, count - first); }

// Element k of V consecutive rows of `stride` elements; lanes past the end repeat the last row.
inline REALV gather(global const REAL* source, const long first, const int stride, const int k, const long count) {
#if V == 1
  return source[first * stride + k];
#else
  REAL lanes[V];
  if (first + V <= count) {
    for (int lane = 0; lane < V; ++lane) lanes[lane] = source[(first + lane) * stride + k];
  } else {
    for (int lane = 0; lane < V; ++lane) lanes[lane] = source[min(first + lane, count - 1) * stride + k];
  }
  return LOAD_VECTOR(0, lanes);
#endif
}

inline void scatter(const REALV values, global REAL* target, const long first, const int stride, const int k,
                    const int lanes) {
#if V == 1
  target[first * stride + k] = values;
#else
  REAL all[V];
  STORE_VECTOR(values, 0, all);
  for (int lane = 0; lane < lanes; ++lane) target[(first + lane) * stride + k] = all[lane];
#endif
}

// Columns of V consecutive rows of 3 or 4; lanes past the end repeat the last row and are not stored.
inline void gather_rows(global const REAL* source, const long first, const int stride, const long count,
                        REALV* columns) {
  if (first + V > count) {
    for (int k = 0; k < stride; ++k) columns[k] = gather(source, first, stride, k, count);
  } else if (stride == 3) {
    load_rows_of_3(source + first * 3, columns);
  } else {
    load_rows_of_4(source + first * 4, columns);
  }
}

inline void scatter_rows(const REALV* columns, global REAL* target, const long first, const int stride,
                         const int lanes) {
  if (lanes < V) {
    for (int k = 0; k < stride; ++k) scatter(columns[k], target, first, stride, k, lanes);
  } else if (stride == 3) {
    store_rows_of_3(columns[0], columns[1], columns[2], target + first * 3);
  } else {
    store_rows_of_4(columns[0], columns[1], columns[2], columns[3], target + first * 4);
  }
}

#if V == 16
// Row i, lane j <-> row j, lane i. Each round moves one bit of the row's number into the lane's.
inline void transpose_16(REALV rows[16]) {
  for (int round = 0; round < 4; ++round) {
    REALV merged[16];
    for (int i = 0; i < 8; ++i) {
      merged[2 * i] = MERGE_LOW(rows[i], rows[i + 8]);
      merged[2 * i + 1] = MERGE_HIGH(rows[i], rows[i + 8]);
    }
    for (int i = 0; i < 16; ++i) rows[i] = merged[i];
  }
}
#endif

// rows[16 i + k] = columns[k], lane i; the columns are used up.
inline void scatter_rows_of_16(REALV columns[16], global REAL* rows, const int lanes) {
#if V == 1
  for (int k = 0; k < 16; ++k) rows[k] = columns[k];
#else
  transpose_16(columns);
  if (lanes == V) {
    for (int lane = 0; lane < V; ++lane) STORE_VECTOR(columns[lane], lane, rows);
  } else {
    for (int lane = 0; lane < lanes; ++lane) STORE_VECTOR(columns[lane], lane, rows);
  }
#endif
}
