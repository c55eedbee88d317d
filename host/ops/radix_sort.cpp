#include "host/ops/radix_sort.h"

#include <algorithm>

namespace degas {
namespace {

/// Few long chunks for CPU cores, many short ones for GPUs.
Chunks chunks_of(const Device& device, int64_t elements) {
  if (device.is_wide()) return long_chunks(device, elements);
  constexpr int64_t gpu_size = 256;
  return {gpu_size, static_cast<uint32_t>((elements + gpu_size - 1) / gpu_size)};
}

int digit_bits(const Device& device) {
  return device.is_wide() ? 11 : 4;
}

template <typename... Arguments>
void launch_sort(Device& device, const char* name, uint32_t items, const Arguments&... arguments) {
  device.kernel("radix_sort", name, {{"DIGIT_BITS", digit_bits(device)}})
      .launch({items}, {device.is_wide() ? size_t{1} : size_t{64}}, arguments...);
}

/// Exclusive scan of the first `count` values; the total lands behind the block sums.
int64_t scan(const Tensor& values, const Tensor& block_sums, const Tensor& sums, int64_t count) {
  Device& device = values.device();
  const Chunks blocks = chunks_of(device, count);
  const auto n = static_cast<uint32_t>(count);
  launch_sort(device, "sum_blocks", blocks.count, values, block_sums, blocks.size, blocks.count, n);
  launch_sort(device, "scan_block_sums", 1, block_sums, blocks.count);
  launch_sort(device, "scan_blocks", blocks.count, values, block_sums, sums, blocks.size, blocks.count, n);
  return blocks.count;
}

}  // namespace

Chunks long_chunks(const Device& device, int64_t elements) {
  // Two a core, so that a core that is held up leaves the others something to do. More would only share the cache lines
  // that two chunks write to.
  constexpr int64_t least = 1024;
  // Never fewer chunks for more elements: tables are made for the most there will be.
  const int64_t wanted = 2 * std::clamp(device.description().compute_units, 1, 512);
  const int64_t size = std::max((elements + wanted - 1) / wanted, least);
  return {static_cast<uint32_t>(size), static_cast<uint32_t>(std::max<int64_t>(1, (elements + size - 1) / size))};
}

Tensor sorted_places(const Tensor& keys, int64_t count, int bits) {
  Device& device = keys.device();
  const auto n = static_cast<uint32_t>(count);
  const Chunks chunks = chunks_of(device, count);
  // Sizes follow the tensor's, not the count: they stay the same from view to view.
  const int64_t table_size = int64_t{chunks_of(device, keys.size()).count} << digit_bits(device);
  const Tensor table(device, {table_size}, Element::UInt32);
  const Tensor block_sums(device, {chunks_of(device, table_size).count + int64_t{1}}, Element::UInt64);
  const Tensor places(device, keys.shape(), Element::UInt32);
  Tensor pairs;
  for (int shift = 0; shift < bits; shift += digit_bits(device)) {
    const Tensor moved =
        shift + digit_bits(device) < bits ? Tensor(device, {keys.size(), 2}, Element::UInt32) : Tensor();
    launch_sort(device, "count_digits", chunks.count, keys, pairs, table, shift, chunks.size, chunks.count, n);
    if (!device.is_wide()) scan(table, block_sums, table, int64_t{chunks.count} << digit_bits(device));
    launch_sort(device, "move_by_digit", chunks.count, keys, pairs, table, moved, places, shift, chunks.size,
                chunks.count, n);
    pairs = moved;
  }
  return places;
}

Scan exclusive_scan(const Tensor& values, int64_t count) {
  Device& device = values.device();
  const int64_t room = chunks_of(device, values.size()).count;
  const Scan result{Tensor(device, values.shape(), Element::UInt32), Tensor(device, {room + 1}, Element::UInt64),
                    chunks_of(device, count).count};
  scan(values, result.totals, result.sums, count);
  return result;
}

}  // namespace degas
