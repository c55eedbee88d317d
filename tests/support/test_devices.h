#pragma once

#include <string>
#include <vector>

#include "host/autograd/tensor.h"
#include "tests/support/catch.h"

namespace degas::test {

/// One device per parameter set and precision, made once a program, with poisoned memory.
Device& device(KernelSet kernel_set, Real real = Real::Float);

/// Both parameter sets, for GENERATE(from_range(kernel_sets())): the GPU set runs on PoCL too, for correctness.
std::vector<KernelSet> kernel_sets();

/// Uniform numbers in [low, high).
std::vector<double> random_values(int64_t count, unsigned seed, double low = -1, double high = 1);
Tensor random_tensor(Device& device, Shape shape, unsigned seed, double low = -1, double high = 1);

/// Largest |a - b| / (1 + |b|); infinity on NaN or when sizes differ.
double largest_difference(const std::vector<double>& a, const std::vector<double>& b);

/// A path below DEGAS_TEST_DATA, or empty (with a printed message) where the data is absent: the test then returns.
std::string data_path(const std::string& relative);

}  // namespace degas::test
