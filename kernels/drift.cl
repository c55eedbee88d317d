// How far groups of rows of an array (count, 3) have moved as wholes: the lengths of their mean vectors.
// Arrays: members (count) int, the rows group by group; starts (groups + 1) int, where each begins in `members`;
// group_of_row (count) int; means (groups, 3).
// -D GROUP: items of a work-group of group_means, a power of two; 1 when WIDE.
// Launch: group_means one work-group per group; drift one item; drift_gradient one item per row, local size free.
// Deterministic: every sum has an order fixed by the sizes.
#include "common/real.cl"
#include "common/group_sum.cl"

// means (groups, 3): of the rows of `vectors` that members[starts[g] .. starts[g + 1]) names
kernel void group_means(global const REAL* vectors, global const int* members, global const int* starts,
                        global REAL* means, local REAL* scratch) {
  const int group = get_group_id(0), begin = starts[group], end = starts[group + 1];
  REAL sums[3] = {0, 0, 0};
  for (int i = begin + get_local_id(0); i < end; i += GROUP) {
    for (int axis = 0; axis < 3; ++axis) sums[axis] += vectors[3 * (long)members[i] + axis];
  }
  for (int axis = 0; axis < 3; ++axis) {
    const REAL total = sum_of_group(sums[axis], scratch);
    if (get_local_id(0) == 0) means[3 * group + axis] = total / max(end - begin, 1);
  }
}

// The length of a group's mean.
inline REAL length_of(global const REAL* means, const int group) {
  const REAL x = means[3 * group], y = means[3 * group + 1], z = means[3 * group + 2];
  return sqrt(x * x + y * y + z * z);
}

// output = the groups' lengths, each counted as often as the group has rows, over all rows
kernel void drift(global const REAL* means, global const int* starts, global REAL* output, const int groups) {
  if (get_global_id(0) != 0) return;
  REAL total = 0;
  for (int group = 0; group < groups; ++group) total += (starts[group + 1] - starts[group]) * length_of(means, group);
  output[0] = total / starts[groups];
}

// A group whose mean is zero gets no gradient.
kernel void drift_gradient(global const REAL* means, global const int* group_of_row, global const REAL* upstream,
                           global REAL* gradient, const long count) {
  const long i = get_global_id(0);
  if (i >= count) return;
  const REAL length = length_of(means, group_of_row[i]);
  const REAL factor = length == 0 ? 0 : upstream[0] / (length * count);
  for (int axis = 0; axis < 3; ++axis) gradient[3 * i + axis] = factor * means[3 * group_of_row[i] + axis];
}
