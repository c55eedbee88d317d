// The last vector of a row whose length is no multiple of V: `count` of its lanes exist, 1 .. V or more.
REALV load_tail(global const REAL* pointer, const long count) {
#if V > 1
  if (count < V) {
    REAL lanes[V];
    for (int lane = 0; lane < V; ++lane) lanes[lane] = lane < count ? pointer[lane] : 0;
    return LOAD_VECTOR(0, lanes);
  }
#endif
  return LOAD_VECTOR(0, pointer);
}

void store_tail(const REALV value, global REAL* pointer, const long count) {
#if V > 1
  if (count < V) {
    REAL lanes[V];
    STORE_VECTOR(value, 0, lanes);
    for (int lane = 0; lane < count; ++lane) pointer[lane] = lanes[lane];
    return;
  }
#endif
  STORE_VECTOR(value, 0, pointer);
}
