// Weight normalisation w = gain[o] * v / ||v||, the Euclidean norm taken over the whole tensor, and its gradient:
//   s[o] = sum of dw * v over the elements of output o;   dgain[o] = s[o] / ||v||
//   dv = gain[o] * dw / ||v|| - v * (sum_o gain[o] s[o]) / ||v||^3
// Layout: v and w are (groups, rows, columns), an element's output o = group * columns + column; gain is (groups * columns).
// norm[0] = ||v||, norm[1] = 1 / ||v||.
// Large tensors take a kernel for every pass; small ones, which most of a network's are, one work-group for all:
// there launches would cost more than the work.
// -D GROUP: items of that work-group, a power of two; 1 when WIDE.
// Deterministic: every sum has a fixed order that depends on the sizes only.
#include "common/real.cl"
#include "common/group_sum.cl"
#include "common/tail.cl"

// partial[p] = sum of a * b over vectors begin, begin + step, .. of item p. Launch: one item per partial sum. On CPUs an
// item owns one stretch (stretch = vectors per item), on GPUs neighbouring items read neighbouring vectors (stretch = 1).
// The elements after the last whole vector go to item 0.
kernel void partial_dot(global const REAL* a, global const REAL* b, global REAL* partial, const int partials,
                        const long stretch, const long count) {
  const int p = get_global_id(0);
  if (p >= partials) return;
  const long vectors = count / V;
  const long begin = stretch > 1 ? p * stretch : p;
  const long end = stretch > 1 ? min(begin + stretch, vectors) : vectors;
  const long step = stretch > 1 ? 1 : partials;
  REALV sums = 0;
  for (long i = begin; i < end; i += step) sums += LOAD_VECTOR(i, a) * LOAD_VECTOR(i, b);
  REAL total = sum_of_lanes(sums);
  if (p == 0) {
    for (long i = vectors * V; i < count; ++i) total += a[i] * b[i];
  }
  partial[p] = total;
}

// One item: norm from the partial sums of v * v. A tensor of zeros has norm 0 and, rather than NaN, weights of 0.
kernel void finish_norm(global const REAL* partial, const int partials, global REAL* norm) {
  REAL total = 0;
  for (int p = 0; p < partials; ++p) total += partial[p];
  norm[0] = sqrt(total);
  norm[1] = total > 0 ? 1 / norm[0] : 0;
}

// One item: total[0] = sum of the partial sums.
kernel void finish_dot(global const REAL* partial, const int partials, global REAL* total) {
  REAL sum = 0;
  for (int p = 0; p < partials; ++p) sum += partial[p];
  total[0] = sum;
}

// Vectors of a row, and where one of them begins, for the two kernels of small tensors.
#define ROW_VECTORS ((columns + V - 1) / V)
#define PLACE_VECTOR(number)                           \
  const int row = (number) / vectors;                  \
  const int first = ((number)-row * vectors) * V;      \
  const int start = row * columns + first, lanes = columns - first

// Elements whose squares are summed before the sum is added to that of others: long sums would lose digits.
#define STRETCH (GROUP > 1 ? V : 256 * V)

// All of the forward pass. Launch: one work-group; scratch: GROUP numbers.
kernel void weight_norm_small(global const REAL* v, global const REAL* gain, global REAL* norm, global REAL* w,
                              local REAL* scratch, const int groups, const int rows, const int columns) {
  const int item = get_local_id(0), count = groups * rows * columns, vectors = ROW_VECTORS;
  const int whole = count / V * V;
  REAL sum = 0;
  for (int begin = item * STRETCH; begin < whole; begin += GROUP * STRETCH) {
    REALV squares = 0;
    for (int i = begin; i < min(begin + STRETCH, whole); i += V) {
      const REALV value = LOAD_VECTOR(0, v + i);
      squares += value * value;
    }
    sum += sum_of_lanes(squares);
  }
  for (int i = whole + item; i < count; i += GROUP) sum += v[i] * v[i];
  const REAL total = sum_of_group(sum, scratch);
  const REAL length = sqrt(total), inverse = total > 0 ? 1 / length : 0;
  if (item == 0) {
    norm[0] = length;
    norm[1] = inverse;
  }
  for (int i = item; i < groups * rows * vectors; i += GROUP) {
    PLACE_VECTOR(i);
    const REALV factor = load_tail(gain + row / rows * columns + first, lanes);
    store_tail(factor * load_tail(v + start, lanes) * inverse, w + start, lanes);
  }
}

// All of the backward pass. Launch as above.
kernel void weight_norm_small_backward(global const REAL* v, global const REAL* gain, global const REAL* norm,
                                       global const REAL* dw, global REAL* dv, global REAL* dgain, local REAL* scratch,
                                       const int groups, const int rows, const int columns) {
  const int item = get_local_id(0), vectors = ROW_VECTORS;
  const REAL inverse = norm[1];
  REAL along = 0;
  for (int i = item; i < groups * vectors; i += GROUP) {
    const int group = i / vectors, first = (i - group * vectors) * V, lanes = columns - first;
    REALV sums = 0;
    for (int row = 0; row < rows; ++row) {
      const int at = (group * rows + row) * columns + first;
      sums += load_tail(v + at, lanes) * load_tail(dw + at, lanes);
    }
    const int output = group * columns + first;
    store_tail(inverse * sums, dgain + output, lanes);
    along += sum_of_lanes(load_tail(gain + output, lanes) * sums);
  }
  along = sum_of_group(along, scratch) * inverse * inverse * inverse;
  for (int i = item; i < groups * rows * vectors; i += GROUP) {
    PLACE_VECTOR(i);
    const REALV factor = inverse * load_tail(gain + row / rows * columns + first, lanes);
    store_tail(factor * load_tail(dw + start, lanes) - along * load_tail(v + start, lanes), dv + start, lanes);
  }
}

// Launch for the next two: (ceil(columns / V), groups * rows); a row's last columns, too few for a vector, go one by one.
#define ROW_ELEMENTS                                      \
  const int first = (int)get_global_id(0) * V;            \
  const long row = get_global_id(1);                      \
  if (first >= columns || row >= groups * (long)rows) return; \
  const long start = row * columns + first;               \
  const int output = (int)(row / rows) * columns + first; \
  const int lanes = min(V, columns - first)

kernel void weight_norm(global const REAL* v, global const REAL* gain, global const REAL* norm, global REAL* w,
                        const int groups, const int rows, const int columns) {
  ROW_ELEMENTS;
  const REAL inverse = norm[1];
  if (lanes == V) {
    STORE_VECTOR(LOAD_VECTOR(0, gain + output) * LOAD_VECTOR(0, v + start) * inverse, 0, w + start);
  } else {
    for (int i = 0; i < lanes; ++i) w[start + i] = gain[output + i] * v[start + i] * inverse;
  }
}

kernel void weight_norm_backward(global const REAL* v, global const REAL* gain, global const REAL* norm,
                                 global const REAL* dw, global const REAL* dot, global REAL* dv, const int groups,
                                 const int rows, const int columns) {
  ROW_ELEMENTS;
  const REAL inverse = norm[1];
  const REAL along = dot[0] * inverse * inverse * inverse;
  if (lanes == V) {
    STORE_VECTOR(LOAD_VECTOR(0, gain + output) * LOAD_VECTOR(0, dw + start) * inverse - LOAD_VECTOR(0, v + start) * along, 0,
                 dv + start);
  } else {
    for (int i = 0; i < lanes; ++i) dv[start + i] = gain[output + i] * dw[start + i] * inverse - v[start + i] * along;
  }
}

// partial[chunk, o] = sum of dw * v over the rows [chunk * chunk_rows, ..) of o's group.
// Launch: (ceil(columns / V), chunks, groups).
kernel void output_sums(global const REAL* v, global const REAL* dw, global REAL* partial, const int groups, const int rows,
                        const int columns, const int chunk_rows) {
  const int first = (int)get_global_id(0) * V;
  const int chunk = get_global_id(1), group = get_global_id(2);
  if (first >= columns || chunk * chunk_rows >= rows) return;
  const int lanes = min(V, columns - first);
  const int end = min((chunk + 1) * chunk_rows, rows);
  const long group_start = (long)group * rows * columns + first;
  global REAL* target = partial + ((long)chunk * groups + group) * columns + first;
  if (lanes == V) {
    REALV sums = 0;
    for (int row = chunk * chunk_rows; row < end; ++row) {
      sums += LOAD_VECTOR(0, v + group_start + (long)row * columns) * LOAD_VECTOR(0, dw + group_start + (long)row * columns);
    }
    STORE_VECTOR(sums, 0, target);
  } else {
    for (int i = 0; i < lanes; ++i) {
      REAL sum = 0;
      for (int row = chunk * chunk_rows; row < end; ++row) {
        const long at = group_start + (long)row * columns + i;
        sum += v[at] * dw[at];
      }
      target[i] = sum;
    }
  }
}

// dgain[o] = s[o] / ||v||, s[o] = sum over chunks. Launch: one item per output.
kernel void finish_output_sums(global const REAL* partial, global const REAL* norm, global REAL* sums, global REAL* dgain,
                               const int chunks, const int outputs) {
  const int o = get_global_id(0);
  if (o >= outputs) return;
  REAL sum = 0;
  for (int chunk = 0; chunk < chunks; ++chunk) sum += partial[(long)chunk * outputs + o];
  sums[o] = sum;
  dgain[o] = sum * norm[1];
}
