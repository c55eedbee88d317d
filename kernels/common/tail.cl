// The last vector of a row whose length is no multiple of V: `count` of its lanes exist, 1 .. V or more. Parts move as
// vectors of 8, 4 and 2: lane by lane, or by way of memory, they would cost more than a narrow row's arithmetic.
#if V > 1
JOIN(REAL, 2) load_below_2(global const REAL* pointer, const int count) {
  return (JOIN(REAL, 2))(count & 1 ? pointer[0] : (REAL)0, (REAL)0);
}

void store_below_2(const JOIN(REAL, 2) value, global REAL* pointer, const int count) {
  if (count & 1) pointer[0] = value.x;
}

// The functions for 0 .. N - 1 of N lanes, from those for half as many.
#define DEFINE_BELOW(N, HALF)                                                                                       \
  JOIN(REAL, N) JOIN(load_below_, N)(global const REAL* pointer, const int count) {                                 \
    if (count & HALF)                                                                                               \
      return (JOIN(REAL, N))(JOIN(vload, HALF)(0, pointer), JOIN(load_below_, HALF)(pointer + HALF, count));        \
    return (JOIN(REAL, N))(JOIN(load_below_, HALF)(pointer, count), (JOIN(REAL, HALF))(0));                         \
  }                                                                                                                 \
  void JOIN(store_below_, N)(const JOIN(REAL, N) value, global REAL* pointer, const int count) {                    \
    if (count & HALF) {                                                                                             \
      JOIN(vstore, HALF)(value.lo, 0, pointer);                                                                     \
      JOIN(store_below_, HALF)(value.hi, pointer + HALF, count);                                                    \
    } else {                                                                                                        \
      JOIN(store_below_, HALF)(value.lo, pointer, count);                                                           \
    }                                                                                                               \
  }
#if V > 2
DEFINE_BELOW(4, 2)
#endif
#if V > 4
DEFINE_BELOW(8, 4)
#endif
#if V > 8
DEFINE_BELOW(16, 8)
#endif
#endif

REALV load_tail(global const REAL* pointer, const long count) {
#if V > 1
  if (count < V) return JOIN(load_below_, V)(pointer, (int)count);
#endif
  return LOAD_VECTOR(0, pointer);
}

void store_tail(const REALV value, global REAL* pointer, const long count) {
#if V > 1
  if (count < V) {
    JOIN(store_below_, V)(value, pointer, (int)count);
    return;
  }
#endif
  STORE_VECTOR(value, 0, pointer);
}
