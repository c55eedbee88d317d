#pragma once

#include "host/autograd/tensor.h"

namespace degas {

struct SortedKeys {
  Tensor keys;    ///< UInt32, ascending
  Tensor places;  ///< UInt32: where in the input each key stood; equal keys keep their order
};

/// Sorts the first `count` of the keys (UInt32) by their lowest `bits` bits, stably. Outputs are as large as `keys`;
/// what lies behind `count` is not defined. kernels/radix_sort.cl
SortedKeys radix_sort(const Tensor& keys, int64_t count, int bits = 32);

/// Exclusive sums of UInt32 values, cut to 32 bits, and behind them the whole sum: `totals` is UInt64 and holds it at
/// index `total_index`.
struct Scan {
  Tensor sums;
  Tensor totals;
  int64_t total_index;
};
Scan exclusive_scan(const Tensor& values);

}  // namespace degas
