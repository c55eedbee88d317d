#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "host/autograd/tensor.h"

namespace degas {

/// The network's trainable tensors by name, in the order of their creation. Values depend on the seed and on each
/// tensor's name alone, so switching one part off leaves the others' initial values as they were.
class ParameterStore {
 public:
  struct Parameter {
    std::string name;  ///< path of blocks, as "decoder.0.first.v"
    Tensor value;
  };
  ParameterStore(Device& device, uint64_t seed) : device_(device), seed_(seed) {}

  Device& device() const { return device_; }
  /// Uniform in +-bound. Throws std::logic_error when the name is taken.
  Tensor create_uniform(const std::string& name, const Shape& shape, double bound);
  Tensor create_zeros(const std::string& name, const Shape& shape);
  /// `count` times the Euclidean norm that `other` was created with: the gain that makes weight normalisation start as
  /// the identity.
  Tensor create_gain(const std::string& name, const std::string& other, int64_t count);

  const std::vector<Parameter>& parameters() const { return parameters_; }
  /// Throws std::logic_error when there is none.
  const Tensor& find(std::string_view name) const;
  bool contains(std::string_view name) const;
  /// Numbers in all tensors.
  int64_t count() const;

 private:
  Tensor add(const std::string& name, Tensor tensor, double norm);
  Tensor add(const std::string& name, const Shape& shape, const std::vector<float>& values);

  Device& device_;
  uint64_t seed_;
  std::vector<Parameter> parameters_;
  std::vector<double> norms_;  ///< of the initial values, by index
};

/// Standard normal numbers that depend on seed and index only, the same on every machine (splitmix64 and Box-Muller).
std::vector<float> normal_numbers(uint64_t seed, int64_t count);

}  // namespace degas
