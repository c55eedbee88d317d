// Adam over many parameter arrays with one global gradient norm, never waiting for the host.
//   1. square_sums, once a parameter that has a gradient: squared norms of blocks into `partial`, marks it present.
//   2. decide, once: the norm over all of them; whether the step is applied; clip factor; per-parameter bias correction.
//   3. update, once a parameter of 1.: moments and value, or nothing when the step is skipped.
// state: REAL[2] = norm, factor on the gradients (0 when skipped).
// counters: int[3] = steps applied, steps skipped, steps skipped in a row up to now.
// applied, present: int per parameter. bias: REAL[2] per parameter = 1 - beta1^t, sqrt(1 - beta2^t), t = steps in which
// the parameter itself was updated.
// -D BLOCK: gradient elements per slot of `partial`, a multiple of GROUP * V. -D GROUP: items of a work-group, a power of
// two; 1 when WIDE.
// Launch: square_sums one group per block; decide one group; update one item per V elements, local size free.
// Deterministic: every sum has an order fixed by the sizes.
#include "common/real.cl"
#include "common/group_sum.cl"

// partial[first_slot + b] = sum of squares of gradient[b * BLOCK .. (b + 1) * BLOCK)
kernel void square_sums(global const REAL* gradient, global REAL* partial, global int* present, local REAL* scratch,
                        const int first_slot, const int parameter, const long count) {
  const long begin = (long)get_group_id(0) * BLOCK;
  const long end = min(begin + BLOCK, count);
  REALV sums = 0;
  long i = begin + get_local_id(0) * V;
  for (; i + V <= end; i += GROUP * V) {
    const REALV value = LOAD_VECTOR(0, gradient + i);
    sums += value * value;
  }
  REAL total = sum_of_lanes(sums);
  // The one vector cut off by the end of the array.
  for (; i < end; ++i) total += gradient[i] * gradient[i];
  total = sum_of_group(total, scratch);
  if (get_local_id(0) == 0) {
    partial[first_slot + get_group_id(0)] = total;
    if (begin == 0) present[parameter] = 1;
  }
}

// A norm above clip_above is scaled to clip_to (clip_above 0: never). log_beta: natural logarithms of the betas.
kernel void decide(global const REAL* partial, global int* present, global int* applied, global REAL* bias,
                   global REAL* state, global int* counters, local REAL* scratch, const int slots, const int parameters,
                   const REAL clip_above, const REAL clip_to, const REAL log_beta1, const REAL log_beta2) {
  const int item = get_local_id(0);
  REAL total = 0;
  for (int slot = item; slot < slots; slot += GROUP) total += partial[slot];
  total = sum_of_group(total, scratch);
  if (item == 0) {
    const REAL norm = sqrt(total);
    // Phrased so that NaN fails; the largest finite float bounds it in double precision too.
    const int finite = norm <= (REAL)3.0e38f;
    state[0] = norm;
    state[1] = !finite ? 0 : clip_above > 0 && norm > clip_above ? clip_to / norm : (REAL)1;
    counters[0] += finite;
    counters[1] += !finite;
    counters[2] = finite ? 0 : counters[2] + 1;
  }
#if GROUP > 1
  barrier(CLK_GLOBAL_MEM_FENCE);
#endif
  const int apply = state[1] != 0;
  for (int parameter = item; parameter < parameters; parameter += GROUP) {
    if (!present[parameter]) continue;
    present[parameter] = 0;
    if (!apply) continue;
    const int steps = ++applied[parameter];
    // expm1: 1 - beta^t keeps its digits where beta^t is close to 1.
    bias[2 * parameter] = -expm1(steps * log_beta1);
    bias[2 * parameter + 1] = sqrt(-expm1(steps * log_beta2));
  }
}

kernel void update(global REAL* value, global const REAL* gradient, global REAL* first_moment, global REAL* second_moment,
                   global const REAL* bias, global const REAL* state, const int parameter, const REAL learning_rate,
                   const REAL beta1, const REAL beta2, const REAL epsilon, const long count) {
  const long i = get_global_id(0);
  const REAL factor = state[1];
  if (i * V >= count || factor == 0) return;
  const REALV g = factor * LOAD_VECTOR(i, gradient);
  const REALV m = beta1 * LOAD_VECTOR(i, first_moment) + (1 - beta1) * g;
  const REALV v = beta2 * LOAD_VECTOR(i, second_moment) + (1 - beta2) * g * g;
  STORE_VECTOR(m, i, first_moment);
  STORE_VECTOR(v, i, second_moment);
  const REALV denominator = sqrt(v) / bias[2 * parameter + 1] + epsilon;
  STORE_VECTOR(LOAD_VECTOR(i, value) - learning_rate / bias[2 * parameter] * m / denominator, i, value);
}
