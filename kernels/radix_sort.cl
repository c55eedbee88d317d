// Stable least-significant-digit radix sort of uint keys, and the exclusive scan it rests on.
// A pass: count_digits, scan of the (digit, chunk) table, move_by_digit. Stability makes (key, place in the input) a
// total order, so results do not depend on scheduling.
// -D DIGIT_BITS: bits of a pass (1..11; an item holds 2^DIGIT_BITS counters).
// Arrays: keys (n) uint, places (n) uint (null: the identity), digit_counts (2^DIGIT_BITS * chunks) uint.
// Launch: one item per chunk of `chunk_size` consecutive keys, or per block of `block` values; local size free.
#include "common/real.cl"

#define DIGITS (1 << DIGIT_BITS)

kernel void count_digits(global const uint* keys, global uint* digit_counts, const int shift, const uint chunk_size,
                         const uint chunks, const uint count) {
  const uint chunk = get_global_id(0);
  if (chunk >= chunks) return;
  uint counters[DIGITS];
  for (int digit = 0; digit < DIGITS; ++digit) counters[digit] = 0;
  const uint begin = chunk * chunk_size, end = min(begin + chunk_size, count);
  for (uint i = begin; i < end; ++i) ++counters[(keys[i] >> shift) & (DIGITS - 1)];
  for (int digit = 0; digit < DIGITS; ++digit) digit_counts[digit * chunks + chunk] = counters[digit];
}

kernel void move_by_digit(global const uint* keys, global const uint* places, global const uint* digit_starts,
                          global uint* moved_keys, global uint* moved_places, const int shift, const uint chunk_size,
                          const uint chunks, const uint count) {
  const uint chunk = get_global_id(0);
  if (chunk >= chunks) return;
  uint targets[DIGITS];
  for (int digit = 0; digit < DIGITS; ++digit) targets[digit] = digit_starts[digit * chunks + chunk];
  const uint begin = chunk * chunk_size, end = min(begin + chunk_size, count);
  for (uint i = begin; i < end; ++i) {
    const uint key = keys[i], target = targets[(key >> shift) & (DIGITS - 1)]++;
    moved_keys[target] = key;
    moved_places[target] = places ? places[i] : i;
  }
}

kernel void sum_blocks(global const uint* values, global ulong* block_sums, const uint block, const uint blocks,
                       const uint count) {
  const uint b = get_global_id(0);
  if (b >= blocks) return;
  const uint begin = b * block, end = min(begin + block, count);
  ulong total = 0;
  for (uint i = begin; i < end; ++i) total += values[i];
  block_sums[b] = total;
}

// One item: block sums become their exclusive scan, and block_sums[blocks] the total.
kernel void scan_block_sums(global ulong* block_sums, const uint blocks) {
  if (get_global_id(0) != 0) return;
  ulong total = 0;
  for (uint b = 0; b < blocks; ++b) {
    const ulong sum = block_sums[b];
    block_sums[b] = total;
    total += sum;
  }
  block_sums[blocks] = total;
}

// values and scanned may be the same array. Sums are cut to 32 bits: the host looks at the 64-bit total.
kernel void scan_blocks(global const uint* values, global const ulong* block_sums, global uint* scanned,
                        const uint block, const uint blocks, const uint count) {
  const uint b = get_global_id(0);
  if (b >= blocks) return;
  const uint begin = b * block, end = min(begin + block, count);
  uint total = (uint)block_sums[b];
  for (uint i = begin; i < end; ++i) {
    const uint value = values[i];
    scanned[i] = total;
    total += value;
  }
}
