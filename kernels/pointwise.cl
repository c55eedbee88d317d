// Pointwise operations on arrays of equal size, forward and backward.
// Launch: one item per V consecutive elements; local size free. The last item may run past `count` within the padding
// of its tensors (host/autograd/tensor.h). Deterministic: no element is written twice.
#include "common/real.cl"

#define INDEX_OR_RETURN                 \
  const long i = get_global_id(0);      \
  if (i * V >= count) return

// output = a + b; output may be a
kernel void add(global const REAL* a, global const REAL* b, global REAL* output, const long count) {
  INDEX_OR_RETURN;
  STORE_VECTOR(LOAD_VECTOR(i, a) + LOAD_VECTOR(i, b), i, output);
}

// output = a * b; serves as its own gradient: da = doutput * b
kernel void multiply(global const REAL* a, global const REAL* b, global REAL* output, const long count) {
  INDEX_OR_RETURN;
  STORE_VECTOR(LOAD_VECTOR(i, a) * LOAD_VECTOR(i, b), i, output);
}

// array *= factor[0]
kernel void scale_in_place(global REAL* array, global const REAL* factor, const long count) {
  INDEX_OR_RETURN;
  STORE_VECTOR(factor[0] * LOAD_VECTOR(i, array), i, array);
}

// output = factor * input + offset; with offset 0 also its own gradient
kernel void scale(global const REAL* input, global REAL* output, const REAL factor, const REAL offset,
                  const long count) {
  INDEX_OR_RETURN;
  STORE_VECTOR(factor * LOAD_VECTOR(i, input) + offset, i, output);
}
