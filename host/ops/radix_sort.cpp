#include "host/ops/radix_sort.h"

#include <algorithm>

namespace degas {
namespace {

/// A work-item takes `size` consecutive elements: few long chunks for CPU cores, many short ones for GPUs.
struct Chunks {
  uint32_t size, count;
};

Chunks chunks_of(const Device& device, int64_t elements) {
  constexpr int64_t wide_chunks = 16, wide_least = 1024, gpu_size = 256;
  const int64_t size = device.is_wide() ? std::max((elements + wide_chunks - 1) / wide_chunks, wide_least) : gpu_size;
  return {static_cast<uint32_t>(size), static_cast<uint32_t>((elements + size - 1) / size)};
}

int digit_bits(const Device& device) {
  return device.is_wide() ? 11 : 4;
}

template <typename... Arguments>
void launch(Device& device, const char* name, uint32_t items, const Arguments&... arguments) {
  device.kernel("radix_sort", name, {{"DIGIT_BITS", digit_bits(device)}})
      .launch({items}, {device.is_wide() ? size_t{1} : size_t{64}}, arguments...);
}

/// Exclusive scan of the first `count` values; the total lands behind the block sums.
int64_t scan(const Tensor& values, const Tensor& block_sums, const Tensor& sums, int64_t count) {
  Device& device = values.device();
  const Chunks blocks = chunks_of(device, count);
  const auto n = static_cast<uint32_t>(count);
  launch(device, "sum_blocks", blocks.count, values, block_sums, blocks.size, blocks.count, n);
  launch(device, "scan_block_sums", 1, block_sums, blocks.count);
  launch(device, "scan_blocks", blocks.count, values, block_sums, sums, blocks.size, blocks.count, n);
  return blocks.count;
}

}  // namespace

SortedKeys radix_sort(const Tensor& keys, int64_t count, int bits) {
  Device& device = keys.device();
  const int per_pass = digit_bits(device);
  const auto n = static_cast<uint32_t>(count);
  const Chunks chunks = chunks_of(device, count);
  // Sizes follow the tensor's, not the count: they stay the same from view to view.
  const int64_t table_size = int64_t{chunks_of(device, keys.size()).count} << per_pass;
  const Tensor table(device, {table_size}, Element::UInt32);
  const Tensor block_sums(device, {chunks_of(device, table_size).count + int64_t{1}}, Element::UInt64);
  SortedKeys source{keys, Tensor()};
  for (int shift = 0; shift < bits; shift += per_pass) {
    const SortedKeys target{Tensor(device, keys.shape(), Element::UInt32),
                            Tensor(device, keys.shape(), Element::UInt32)};
    launch(device, "count_digits", chunks.count, source.keys, table, shift, chunks.size, chunks.count, n);
    scan(table, block_sums, table, int64_t{chunks.count} << per_pass);
    launch(device, "move_by_digit", chunks.count, source.keys, source.places, table, target.keys, target.places, shift,
           chunks.size, chunks.count, n);
    source = target;
  }
  return source;
}

Scan exclusive_scan(const Tensor& values) {
  Device& device = values.device();
  const int64_t blocks = chunks_of(device, values.size()).count;
  const Scan result{Tensor(device, values.shape(), Element::UInt32), Tensor(device, {blocks + 1}, Element::UInt64),
                    blocks};
  scan(values, result.totals, result.sums, values.size());
  return result;
}

}  // namespace degas
