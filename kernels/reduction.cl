// Sums in a fixed order: an array is cut into blocks of BLOCK elements whose sums are summed again, so the result
// depends on the size alone, not on scheduling.
// -D BLOCK: elements a work-item sums, a multiple of V.
// Launch: one item per block; local size free.
#include "common/real.cl"

// partial[b] = factor * sum of input[b * BLOCK .. (b + 1) * BLOCK)
kernel void block_sum(global const REAL* input, global REAL* partial, const REAL factor, const long count) {
  const long block = get_global_id(0);
  const long begin = block * BLOCK;
  if (begin >= count) return;
  const long end = min(begin + BLOCK, count);
  REAL total = 0;
  long i = begin;
#if V > 1
  REALV sums = 0;
  for (; i + V <= end; i += V) sums += LOAD_VECTOR(0, input + i);
  REAL lanes[V];
  STORE_VECTOR(sums, 0, lanes);
  for (int lane = 0; lane < V; ++lane) total += lanes[lane];
#endif
  for (; i < end; ++i) total += input[i];
  partial[block] = factor * total;
}

// output[i] = factor * scalar[0]: the gradient of a scaled sum
kernel void broadcast(global const REAL* scalar, global REAL* output, const REAL factor, const long count) {
  const long i = get_global_id(0);
  if (i * V >= count) return;
  STORE_VECTOR((REALV)(factor * scalar[0]), i, output);
}
