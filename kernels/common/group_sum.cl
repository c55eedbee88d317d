// Sums over the lanes of a vector and the items of a work-group, in an order fixed by V and GROUP.
// -D GROUP: items of the (one-dimensional) work-group, a power of two; 1: no local memory, no barrier.
REAL sum_of_lanes(REALV vector) {
#if V == 1
  return vector;
#else
  REAL lanes[V], total = 0;
  STORE_VECTOR(vector, 0, lanes);
  for (int lane = 0; lane < V; ++lane) total += lanes[lane];
  return total;
#endif
}

// The sum of one number per item, given to every item. Every item of the group must call it; scratch: GROUP numbers.
REAL sum_of_group(REAL value, local REAL* scratch) {
#if GROUP > 1
  const int item = get_local_id(0);
  // The previous call's result may still be being read.
  barrier(CLK_LOCAL_MEM_FENCE);
  scratch[item] = value;
  for (int half_size = GROUP / 2; half_size > 0; half_size /= 2) {
    barrier(CLK_LOCAL_MEM_FENCE);
    if (item < half_size) scratch[item] += scratch[item + half_size];
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  return scratch[0];
#else
  return value;
#endif
}
