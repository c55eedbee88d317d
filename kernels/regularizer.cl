// Terms of the loss that act on the Gaussian maps, elementwise; host/ops/reduction sums them up.
// Launch: row_lengths* one item per row of 3; scale_excess* and shortfall* one item per V elements; ratio and gate one
// item. Local size free. Deterministic: no element is written twice.
#include "common/real.cl"

// lengths[i] = |rows[i]|, rows (count, 3)
kernel void row_lengths(global const REAL* rows, global REAL* lengths, const long count) {
  const long i = get_global_id(0);
  if (i >= count) return;
  const REAL x = rows[3 * i], y = rows[3 * i + 1], z = rows[3 * i + 2];
  lengths[i] = sqrt(x * x + y * y + z * z);
}

// A row of length zero gets no gradient.
kernel void row_lengths_gradient(global const REAL* rows, global const REAL* lengths,
                                 global const REAL* length_gradient, global REAL* gradient, const long count) {
  const long i = get_global_id(0);
  if (i >= count) return;
  const REAL factor = lengths[i] == 0 ? 0 : length_gradient[i] / lengths[i];
  for (int axis = 0; axis < 3; ++axis) gradient[3 * i + axis] = factor * rows[3 * i + axis];
}

// Phrased so that NaN counts as too large: it must reach the loss.
#define TOO_LARGE(log_scale, base) (!((log_scale) <= (base) + log_limit))

// excess = exp(log_scale) where exp(log_scale) > limit exp(base_log_scale), else 0; flags = 1 or 0 likewise.
kernel void scale_excess(global const REAL* log_scales, global const REAL* base_log_scales, global REAL* excess,
                         global REAL* flags, const REAL log_limit, const long count) {
  const long i = get_global_id(0);
  if (i * V >= count) return;
  const REALV log_scale = LOAD_VECTOR(i, log_scales), base = LOAD_VECTOR(i, base_log_scales);
  STORE_VECTOR(TOO_LARGE(log_scale, base) ? exp(log_scale) : (REALV)0, i, excess);
  STORE_VECTOR(TOO_LARGE(log_scale, base) ? (REALV)1 : (REALV)0, i, flags);
}

// d (total / count of flags) / d log_scale = excess / count
kernel void scale_excess_gradient(global const REAL* excess, global const REAL* flag_count, global const REAL* upstream,
                                  global REAL* gradient, const long count) {
  const long i = get_global_id(0);
  if (i * V >= count) return;
  STORE_VECTOR(upstream[0] / max(flag_count[0], (REAL)1) * LOAD_VECTOR(i, excess), i, gradient);
}

// output = total / max(flag_count, 1)
kernel void ratio(global const REAL* total, global const REAL* flag_count, global REAL* output) {
  if (get_global_id(0) == 0) output[0] = total[0] / max(flag_count[0], (REAL)1);
}

#define SHORTFALL(i) (least + (base ? LOAD_VECTOR(i, base) : (REALV)0) - LOAD_VECTOR(i, values))

// shortfalls = max(0, least + base - values), base absent (null): 0. A NaN stays one: it must reach the loss.
kernel void shortfall(global const REAL* values, global const REAL* base, global REAL* shortfalls, const REAL least,
                      const long count) {
  const long i = get_global_id(0);
  if (i * V >= count) return;
  const REALV lack = SHORTFALL(i);
  STORE_VECTOR(lack <= 0 ? (REALV)0 : lack, i, shortfalls);
}

kernel void shortfall_gradient(global const REAL* values, global const REAL* base, global const REAL* upstream,
                               global REAL* gradient, const REAL least, const long count) {
  const long i = get_global_id(0);
  if (i * V >= count) return;
  STORE_VECTOR(SHORTFALL(i) <= 0 ? (REALV)0 : -LOAD_VECTOR(i, upstream), i, gradient);
}

// output = value where control <= limit, else 0; with the output's gradient as `value` also its own gradient
kernel void gate(global const REAL* value, global const REAL* control, global REAL* output, const REAL limit) {
  if (get_global_id(0) == 0) output[0] = control[0] > limit ? 0 : value[0];
}
