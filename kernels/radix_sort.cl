// Stable least-significant-digit radix sort of uint keys, and the exclusive scan it rests on.
// A pass: count_digits, then move_by_digit with the sums before each (digit, chunk). Where chunks are many (GPU set) a
// scan makes these sums of the counts; where they are few (wide set) every chunk sums for itself, which costs less than
// the scan's launches. Stability makes (key, place in the input) a total order, so results do not depend on scheduling.
// -D DIGIT_BITS: bits of a pass (1..11; an item holds 2^DIGIT_BITS counters).
// Arrays: keys (n) uint, pairs (n) uint2: key and place in the input; digit_counts: (2^DIGIT_BITS, chunks) uint, in the
// wide set (chunks, 2^DIGIT_BITS).
// Launch: one item per chunk of `chunk_size` consecutive keys, or per block of `block` values; local size free.
#include "common/real.cl"

#define DIGITS (1 << DIGIT_BITS)
#if WIDE
#define COUNT_OF(digit, chunk) ((chunk)*DIGITS + (digit))
#else
#define COUNT_OF(digit, chunk) ((digit)*chunks + (chunk))
#endif

// The first pass reads keys (pairs null), all others pairs.
inline uint2 pair_at(global const uint* keys, global const uint2* pairs, const uint i) {
  return pairs ? pairs[i] : (uint2)(keys[i], i);
}

kernel void count_digits(global const uint* keys, global const uint2* pairs, global uint* digit_counts, const int shift,
                         const uint chunk_size, const uint chunks, const uint count) {
  const uint chunk = get_global_id(0);
  if (chunk >= chunks) return;
  uint counters[DIGITS];
  for (int digit = 0; digit < DIGITS; ++digit) counters[digit] = 0;
  const uint begin = chunk * chunk_size, end = min(begin + chunk_size, count);
  for (uint i = begin; i < end; ++i) ++counters[(pair_at(keys, pairs, i).x >> shift) & (DIGITS - 1)];
  for (int digit = 0; digit < DIGITS; ++digit) digit_counts[COUNT_OF(digit, chunk)] = counters[digit];
}

// targets[digit]: where the chunk's first key of that digit goes.
inline void find_targets(global const uint* digit_counts, const uint chunk, const uint chunks, uint* targets) {
#if WIDE
  uint totals[DIGITS];
  for (int digit = 0; digit < DIGITS; ++digit) targets[digit] = totals[digit] = 0;
  for (uint c = 0; c < chunks; ++c) {
    const uint before = c < chunk ? ~0u : 0;
    for (int digit = 0; digit < DIGITS; ++digit) {
      const uint n = digit_counts[COUNT_OF(digit, c)];
      totals[digit] += n;
      targets[digit] += n & before;
    }
  }
  uint start = 0;
  for (int digit = 0; digit < DIGITS; ++digit) {
    targets[digit] += start;
    start += totals[digit];
  }
#else
  for (int digit = 0; digit < DIGITS; ++digit) targets[digit] = digit_counts[COUNT_OF(digit, chunk)];
#endif
}

// digit_counts: as count_digits left them (wide set), or their exclusive scan. The last pass writes places (moved_pairs
// null), all others moved_pairs.
kernel void move_by_digit(global const uint* keys, global const uint2* pairs, global const uint* digit_counts,
                          global uint2* moved_pairs, global uint* places, const int shift, const uint chunk_size,
                          const uint chunks, const uint count) {
  const uint chunk = get_global_id(0);
  if (chunk >= chunks) return;
  uint targets[DIGITS];
  find_targets(digit_counts, chunk, chunks, targets);
  const uint begin = chunk * chunk_size, end = min(begin + chunk_size, count);
  for (uint i = begin; i < end; ++i) {
    const uint2 pair = pair_at(keys, pairs, i);
    const uint target = targets[(pair.x >> shift) & (DIGITS - 1)]++;
    if (moved_pairs) {
      moved_pairs[target] = pair;
    } else {
      places[target] = pair.y;
    }
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
