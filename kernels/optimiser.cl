// Adam and Rprop over many parameter arrays with one global gradient norm, never waiting for the host.
//   1. square_sums, once a batch of parameters that have a gradient: squared norms of blocks into `partial`, whose they
//      are, and that they are present.
//   2. decide, once: the norm over all of them; whether the step is applied; clip factor; each parameter's bias
//      correction.
//   3. adam or rprop, once a batch of 1.: moments (or last gradients and steps) and values, or nothing when the step is
//      skipped.
// Batches as in common/batch.cl.
// state: REAL[5] = norm, factor on the gradients (0 when skipped), logarithm of the largest norm of late (UNKNOWN: of
// none); of the last step skipped its norm and that logarithm.
// counters: int[5] = steps applied, steps skipped, steps skipped in a row up to now; of the last skipped one its number
// and the first parameter whose gradient is not finite, or the one with the largest where all are.
// owners: int per slot of `partial`, the number of its parameter.
// applied, present: int per parameter. bias: REAL[2] per parameter = 1 - beta1^t, sqrt(1 - beta2^t), t = steps in which
// the parameter itself was updated.
// -D BLOCK: elements of a work-group and of a slot of `partial`, a multiple of GROUP * V. -D GROUP: items of a
// work-group, a power of two; 1 when WIDE.
// Launch: square_sums, adam and rprop one group per block, the batch's parameters one after the other; decide one group.
// Deterministic: every sum has an order fixed by the sizes.
#include "common/real.cl"
#include "common/batch.cl"
#include "common/group_sum.cl"

typedef struct {
  long counts[BATCH];     // elements of each parameter
  int parameters[BATCH];  // its number
  int ends[BATCH];        // blocks of it and those before it
} Batch;

// partial[first_slot + b] = sum of squares of the batch's block b
#define GRADIENT(k) global const REAL *gradient##k,
kernel void square_sums(EACH(GRADIENT) global REAL* partial, global int* owners, global int* present,
                        local REAL* scratch, const int first_slot, const Batch batch) {
  const int block = get_group_id(0);
  global const REAL* gradient = gradient0;
  int which = 0;
#define CHOOSE(k)           \
  if (IS_OF(k)) {           \
    which = k;              \
    gradient = gradient##k; \
  }
  EACH(CHOOSE)
#undef CHOOSE
  const long begin = (block - (which > 0 ? batch.ends[which - 1] : 0)) * (long)BLOCK;
  const long end = min(begin + BLOCK, batch.counts[which]);
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
    partial[first_slot + block] = total;
    owners[first_slot + block] = batch.parameters[which];
    if (begin == 0) present[batch.parameters[which]] = 1;
  }
}

// What is known of the largest norm of late: from so many steps on; it is forgotten by a factor of e in so many steps,
// and each spike raises it twofold, so that a change that stays is accepted where it is no more than a change.
#define STEPS_TO_KNOW 20
#define STEPS_TO_FORGET 100
#define LOG_2 0.69314718f
#define UNKNOWN -1e30f

// The parameter to blame for a norm that is too large or not finite. A parameter's slots are neighbours.
int worst_parameter(global const REAL* partial, global const int* owners, const int slots) {
  int worst = owners[0], owner = -1;
  REAL sum = 0, largest = -1;
  for (int slot = 0; slot < slots; ++slot) {
    sum = owners[slot] == owner ? sum + partial[slot] : partial[slot];
    owner = owners[slot];
    if (!(sum <= (REAL)3.0e38f)) return owner;
    if (sum > largest) {
      largest = sum;
      worst = owner;
    }
  }
  return worst;
}

// A norm above clip_above is scaled to clip_to (clip_above 0: never). One above spike_limit times the largest of
// late is skipped (spike_limit 0: never). log_beta: natural logarithms of the betas.
kernel void decide(global const REAL* partial, global const int* owners, global int* present, global int* applied,
                   global REAL* bias, global REAL* state, global int* counters, local REAL* scratch, const int slots,
                   const int parameters, const REAL clip_above, const REAL clip_to, const REAL spike_limit,
                   const REAL log_beta1, const REAL log_beta2) {
  const int item = get_local_id(0);
  REAL total = 0;
  for (int slot = item; slot < slots; slot += GROUP) total += partial[slot];
  total = sum_of_group(total, scratch);
  if (item == 0) {
    const REAL norm = sqrt(total);
    const int is_known = spike_limit > 0 && counters[0] >= STEPS_TO_KNOW && state[2] > UNKNOWN / 2;
    // Phrased so that NaN fails; the largest finite float bounds it in double precision too.
    const int finite = norm <= (REAL)3.0e38f;
    const int good = finite && !(is_known && norm > spike_limit * exp(state[2]));
    state[0] = norm;
    state[1] = !good ? 0 : clip_above > 0 && norm > clip_above ? clip_to / norm : (REAL)1;
    if (good) {
      state[2] = max(log(max(norm, (REAL)1e-30f)), state[2] - (REAL)1 / STEPS_TO_FORGET);
    } else {
      state[3] = norm;
      state[4] = state[2];
      counters[3] = counters[0] + counters[1];
      counters[4] = worst_parameter(partial, owners, slots);
      if (finite) state[2] += LOG_2;
    }
    counters[0] += good;
    counters[1] += !good;
    counters[2] = good ? 0 : counters[2] + 1;
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

#define ARRAYS(k) global REAL *value##k, global const REAL *gradient##k, global REAL *first##k, global REAL *second##k,
#define CHOOSE(k)             \
  if (IS_OF(k)) {             \
    which = k;                \
    value = value##k;         \
    gradient = gradient##k;   \
    first_moment = first##k;  \
    second_moment = second##k; \
  }
// The block's arrays, and its first and last element. The last vector may run past the end, within the arrays' padding.
#define CHOOSE_BLOCK                                                                    \
  const int block = get_group_id(0);                                                    \
  global REAL *value = value0, *first_moment = first0, *second_moment = second0;        \
  global const REAL* gradient = gradient0;                                              \
  int which = 0;                                                                        \
  EACH(CHOOSE)                                                                          \
  const long begin = (block - (which > 0 ? batch.ends[which - 1] : 0)) * (long)BLOCK;   \
  const long end = min(begin + BLOCK, batch.counts[which]);

kernel void adam(EACH(ARRAYS) global const REAL* bias, global const REAL* state, const REAL learning_rate,
                 const REAL beta1, const REAL beta2, const REAL epsilon, const Batch batch) {
  const REAL factor = state[1];
  if (factor == 0) return;
  CHOOSE_BLOCK
  global const REAL* correction = bias + 2 * batch.parameters[which];
  const REAL rate = learning_rate / correction[0], second_correction = correction[1];
  for (long i = begin + get_local_id(0) * V; i < end; i += GROUP * V) {
    const REALV g = factor * LOAD_VECTOR(0, gradient + i);
    const REALV m = beta1 * LOAD_VECTOR(0, first_moment + i) + (1 - beta1) * g;
    const REALV v = beta2 * LOAD_VECTOR(0, second_moment + i) + (1 - beta2) * g * g;
    STORE_VECTOR(m, 0, first_moment + i);
    STORE_VECTOR(v, 0, second_moment + i);
    const REALV denominator = sqrt(v) / second_correction + epsilon;
    STORE_VECTOR(LOAD_VECTOR(0, value + i) - rate * m / denominator, 0, value + i);
  }
}

// first: the last gradient; second: the step in learning rates, 0 before the first.
kernel void rprop(EACH(ARRAYS) global const REAL* state, const REAL learning_rate, const REAL growth,
                  const REAL shrinkage, const REAL smallest, const REAL largest, const Batch batch) {
  if (state[1] == 0) return;
  CHOOSE_BLOCK
  for (long i = begin + get_local_id(0) * V; i < end; i += GROUP * V) {
    const REALV g = LOAD_VECTOR(0, gradient + i), before = LOAD_VECTOR(0, second_moment + i);
    // Signs, as the product of two small gradients may be too small for a number.
    const REALV turn = sign(g) * sign(LOAD_VECTOR(0, first_moment + i));
    const REALV change = turn > 0 ? (REALV)growth : turn < 0 ? (REALV)shrinkage : (REALV)1;
    const REALV step = clamp(change * (before == 0 ? (REALV)1 : before), (REALV)smallest, (REALV)largest);
    STORE_VECTOR(g, 0, first_moment + i);
    STORE_VECTOR(step, 0, second_moment + i);
    STORE_VECTOR(LOAD_VECTOR(0, value + i) - learning_rate * step * sign(g), 0, value + i);
  }
}
