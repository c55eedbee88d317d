// Weight normalisation w = gain[o] * v / ||v||, the Euclidean norm taken over the whole tensor, and its gradient:
//   s[o] = sum of dw * v over the elements of output o;   dgain[o] = s[o] / ||v||
//   dv = gain[o] * dw / ||v|| - v * (sum_o gain[o] s[o]) / ||v||^3
// Layout: v and w are (groups, rows, columns), an element's output o = group * columns + column; gain is
// (groups * columns).
// A launch takes a batch of tensors (common/batch.cl); a block is some whole rows of one group of a tensor. Forward:
// square_sums, weight_norm; backward: output_sums, finish_output_sums, weight_norm_backward.
// numbers (tensors, 2): 1 / ||v||, or 0 for a tensor of zeros; (sum_o gain[o] s[o]) / ||v||^3.
// partial: what the blocks leave for the next launch.
// -D GROUP: items of a work-group, a power of two; 1 when WIDE.
// Launch: a work-group per block; finish_output_sums a work-group per tensor.
// Deterministic: every sum has a fixed order that depends on the sizes only.
#include "common/real.cl"
#include "common/batch.cl"
#include "common/group_sum.cl"
#include "common/tail.cl"

typedef struct {
  int rows[BATCH], columns[BATCH];  // of a group of each tensor
  int block_rows[BATCH];            // of a block; a group's last one may have fewer
  int ends[BATCH];                  // blocks of each tensor and those before it
  int sums[BATCH];                  // where the column sums of its blocks begin in `partial`
  int tensors[BATCH];               // its place in `numbers`
} Batch;

#define VECTORS(columns) (((columns) + V - 1) / V)

// which: the block's tensor. Of the block: number, within the tensor; rows; start, its first element; output, that of
// its first column. The kernel chooses the arrays of `which`.
#define FIND_BLOCK(CHOOSE_ARRAYS)                                                                  \
  const int block = get_group_id(0), item = get_local_id(0);                                       \
  int which = 0;                                                                                   \
  EACH(CHOOSE_ARRAYS)                                                                              \
  const int columns = batch.columns[which], group_rows = batch.rows[which];                        \
  const int first_block = which > 0 ? batch.ends[which - 1] : 0, number = block - first_block;     \
  const int blocks_of_group = (group_rows + batch.block_rows[which] - 1) / batch.block_rows[which]; \
  const int group = number / blocks_of_group;                                                      \
  const int first_row = (number - group * blocks_of_group) * batch.block_rows[which];              \
  const int rows = min(batch.block_rows[which], group_rows - first_row);                           \
  const long start = ((long)group * group_rows + first_row) * columns

// partial[block] = sum of v * v
#define DECLARE(k) global const REAL *v##k,
#define CHOOSE(k) \
  if (IS_OF(k)) which = k, v = v##k;
kernel void square_sums(EACH(DECLARE) global REAL* partial, local REAL* scratch, const Batch batch) {
  global const REAL* v = v0;
  FIND_BLOCK(CHOOSE);
  const int count = rows * columns, whole = count / V * V;
  REALV squares = 0;
  for (int i = item * V; i < whole; i += GROUP * V) {
    const REALV value = LOAD_VECTOR(0, v + start + i);
    squares += value * value;
  }
  REAL sum = sum_of_lanes(squares);
  for (int i = whole + item; i < count; i += GROUP) sum += v[start + i] * v[start + i];
  sum = sum_of_group(sum, scratch);
  if (item == 0) partial[block] = sum;
}
#undef DECLARE
#undef CHOOSE

// w and numbers; a tensor of zeros has, rather than NaN, weights of 0.
#define DECLARE(k) global const REAL *v##k, global const REAL *gain##k, global REAL *w##k,
#define CHOOSE(k) \
  if (IS_OF(k)) which = k, v = v##k, gain = gain##k, w = w##k;
kernel void weight_norm(EACH(DECLARE) global const REAL* partial, global REAL* numbers, local REAL* scratch,
                        const Batch batch) {
  global const REAL *v = v0, *gain = gain0;
  global REAL* w = w0;
  FIND_BLOCK(CHOOSE);
  REAL total = 0;
  for (int b = first_block + item; b < batch.ends[which]; b += GROUP) total += partial[b];
  total = sum_of_group(total, scratch);
  const REAL inverse = total > 0 ? 1 / sqrt(total) : 0;
  if (number == 0 && item == 0) numbers[2 * batch.tensors[which]] = inverse;
  const int vectors = VECTORS(columns);
  for (int i = item; i < rows * vectors; i += GROUP) {
    const int row = i / vectors, first = (i - row * vectors) * V, lanes = columns - first;
    const long at = start + (long)row * columns + first;
    store_tail(load_tail(gain + group * columns + first, lanes) * load_tail(v + at, lanes) * inverse, w + at, lanes);
  }
}
#undef DECLARE
#undef CHOOSE

// partial[sums + number * columns + column] = sum of dw * v over the block's rows
#define DECLARE(k) global const REAL *v##k, global const REAL *dw##k,
#define CHOOSE(k) \
  if (IS_OF(k)) which = k, v = v##k, dw = dw##k;
kernel void output_sums(EACH(DECLARE) global REAL* partial, const Batch batch) {
  global const REAL *v = v0, *dw = dw0;
  FIND_BLOCK(CHOOSE);
  global REAL* target = partial + batch.sums[which] + number * columns;
  for (int first = item * V; first < columns; first += GROUP * V) {
    const int lanes = columns - first;
    REALV sums = 0;
    for (int row = 0; row < rows; ++row) {
      const long at = start + (long)row * columns + first;
      sums += load_tail(v + at, lanes) * load_tail(dw + at, lanes);
    }
    store_tail(sums, target + first, lanes);
  }
}
#undef DECLARE
#undef CHOOSE

// dgain and the second of numbers.
#define DECLARE(k) global const REAL *gain##k, global REAL *dgain##k,
#define CHOOSE(k) \
  if (get_group_id(0) == k) gain = gain##k, dgain = dgain##k;
kernel void finish_output_sums(EACH(DECLARE) global const REAL* partial, global REAL* numbers, local REAL* scratch,
                               const Batch batch) {
  const int which = get_group_id(0), item = get_local_id(0);
  global const REAL* gain = gain0;
  global REAL* dgain = dgain0;
  EACH(CHOOSE)
  const int columns = batch.columns[which], vectors = VECTORS(columns), block_rows = batch.block_rows[which];
  const int blocks = batch.ends[which] - (which > 0 ? batch.ends[which - 1] : 0);
  const int blocks_of_group = (batch.rows[which] + block_rows - 1) / block_rows;
  global REAL* number = numbers + 2 * batch.tensors[which];
  const REAL inverse = number[0];
  REAL along = 0;
  for (int i = item; i < blocks / blocks_of_group * vectors; i += GROUP) {
    const int group = i / vectors, first = (i - group * vectors) * V, lanes = columns - first;
    global const REAL* source = partial + batch.sums[which] + group * blocks_of_group * columns + first;
    REALV sums = 0;
    for (int b = 0; b < blocks_of_group; ++b) sums += load_tail(source + b * columns, lanes);
    store_tail(inverse * sums, dgain + group * columns + first, lanes);
    along += sum_of_lanes(load_tail(gain + group * columns + first, lanes) * sums);
  }
  along = sum_of_group(along, scratch);
  if (item == 0) number[1] = along * inverse * inverse * inverse;
}
#undef DECLARE
#undef CHOOSE

#define DECLARE(k) global const REAL *v##k, global const REAL *gain##k, global const REAL *dw##k, global REAL *dv##k,
#define CHOOSE(k) \
  if (IS_OF(k)) which = k, v = v##k, gain = gain##k, dw = dw##k, dv = dv##k;
kernel void weight_norm_backward(EACH(DECLARE) global const REAL* numbers, const Batch batch) {
  global const REAL *v = v0, *gain = gain0, *dw = dw0;
  global REAL* dv = dv0;
  FIND_BLOCK(CHOOSE);
  const REAL inverse = numbers[2 * batch.tensors[which]], along = numbers[2 * batch.tensors[which] + 1];
  const int vectors = VECTORS(columns);
  for (int i = item; i < rows * vectors; i += GROUP) {
    const int row = i / vectors, first = (i - row * vectors) * V, lanes = columns - first;
    const long at = start + (long)row * columns + first;
    const REALV factor = inverse * load_tail(gain + group * columns + first, lanes);
    store_tail(factor * load_tail(dw + at, lanes) - along * load_tail(v + at, lanes), dv + at, lanes);
  }
}
