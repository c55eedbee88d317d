// The device's roofs for benchmarks: multiply-adds on registers alone, and copies alone. Deterministic.
// -D CHAINS: independent accumulators of V lanes, enough to hide the latency of an addition.
#include "common/real.cl"

// Launch: any number of items; local size free. An item does 2 * CHAINS * V * rounds operations.
kernel void fma_peak(global REAL* output, const REAL factor, const int rounds) {
  const long i = get_global_id(0);
  REALV chain[CHAINS];
#pragma unroll
  for (int c = 0; c < CHAINS; ++c) chain[c] = (REALV)(c + 1);
  for (int round = 0; round < rounds; ++round) {
#pragma unroll
    for (int c = 0; c < CHAINS; ++c) chain[c] = fma(chain[c], (REALV)(factor), (REALV)(factor));
  }
  REALV total = 0;
#pragma unroll
  for (int c = 0; c < CHAINS; ++c) total += chain[c];
  STORE_VECTOR(total, i, output);
}

// Launch: one item per V elements of both arrays; local size free.
kernel void copy_peak(global const REAL* input, global REAL* output) {
  const long i = get_global_id(0);
  STORE_VECTOR(LOAD_VECTOR(i, input), i, output);
}
