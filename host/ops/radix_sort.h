#pragma once

#include "host/autograd/tensor.h"

namespace degas {

/// Where in the input the keys stand that come first, second, ... when the first `count` of them (UInt32) are sorted by
/// their lowest `bits` bits; equal keys keep their order. UInt32, as large as `keys`; what lies behind `count` is not
/// defined. kernels/radix_sort.cl
Tensor sorted_places(const Tensor& keys, int64_t count, int bits = 32);

/// Exclusive sums of the first `count` UInt32 values, cut to 32 bits, as large as `values`, and behind them the whole
/// sum: `totals` is UInt64 and holds it at index `total_index`.
struct Scan {
  Tensor sums;
  Tensor totals;
  int64_t total_index;
};
Scan exclusive_scan(const Tensor& values, int64_t count);

/// What a work-item takes of many elements, where items are to be few long ones for CPU cores: `size` consecutive
/// elements each, `count` items, at least one.
struct Chunks {
  uint32_t size, count;
};
Chunks long_chunks(const Device& device, int64_t elements);

}  // namespace degas
