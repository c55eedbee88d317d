// Signs of an array, a bit each, for the way back through a leaky ReLU whose output nobody keeps.
// signs: 16 elements a word, the first in its lowest bit; set where the element is above 0.
// Launch: one item per word; local size free. The last one may run past the end within the padding of the tensors
// (host/autograd/tensor.h). Deterministic: no element is written twice.
#include "common/real.cl"

#define BITS 16

kernel void pack_signs(global const REAL* values, global ushort* signs, const long words) {
  const long i = get_global_id(0);
  if (i >= words) return;
#if V == BITS
  const int16 bits = (int16)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768);
  const int16 set = convert_int16(LOAD_VECTOR(i, values) > (REAL)0) & bits;
  const int8 eight = set.lo | set.hi;
  const int4 four = eight.lo | eight.hi;
  const int2 two = four.lo | four.hi;
  signs[i] = (ushort)(two.x | two.y);
#else
  uint word = 0;
  for (int bit = 0; bit < BITS; ++bit) word |= (uint)(values[i * BITS + bit] > 0) << bit;
  signs[i] = (ushort)word;
#endif
}

// target = gradient where the sign is set, else slope * gradient; target may be gradient.
kernel void leaky_relu_gradient(global const REAL* gradient, global const ushort* signs, global REAL* target,
                                const REAL slope, const long words) {
  const long i = get_global_id(0);
  if (i >= words) return;
  const uint word = signs[i];
#if V == BITS
  const int16 bits = (int16)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768);
  const REALV value = LOAD_VECTOR(i, gradient);
#if REAL_IS_DOUBLE
  const long16 set = convert_long16(((int16)word & bits) != 0);
#else
  const int16 set = ((int16)word & bits) != 0;
#endif
  STORE_VECTOR(select(slope * value, value, set), i, target);
#else
  for (int bit = 0; bit < BITS; ++bit) {
    const REAL value = gradient[i * BITS + bit];
    target[i * BITS + bit] = word >> bit & 1 ? value : slope * value;
  }
#endif
}
