#include "model/net/parameter_store.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "host/random.h"

namespace degas {
namespace {

uint64_t hash_of(std::string_view text) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (const unsigned char c : text) hash = (hash ^ c) * 0x100000001b3u;
  return hash;
}

}  // namespace

Tensor ParameterStore::add(const std::string& name, Tensor tensor, double norm) {
  if (contains(name)) throw std::logic_error(fmt::format("[parameter_store] '{}' exists already", name));
  tensor.set_requires_gradient();
  parameters_.push_back({name, tensor});
  norms_.push_back(norm);
  return tensor;
}

Tensor ParameterStore::add(const std::string& name, const Shape& shape, const std::vector<float>& values) {
  double square = 0;
  for (const float value : values) square += static_cast<double>(value) * value;
  return add(name, Tensor::from(device_, shape, std::span<const float>(values)), std::sqrt(square));
}

Tensor ParameterStore::create_uniform(const std::string& name, const Shape& shape, double bound) {
  Random random(Random(seed_).next() ^ hash_of(name));
  std::vector<float> values(element_count(shape));
  for (float& value : values) value = static_cast<float>((2 * random.uniform() - 1) * bound);
  return add(name, shape, values);
}

Tensor ParameterStore::create_zeros(const std::string& name, const Shape& shape) {
  return add(name, Tensor::zeros(device_, shape), 0);
}

Tensor ParameterStore::create_gain(const std::string& name, const std::string& other, int64_t count) {
  find(other);
  size_t index = 0;
  while (parameters_[index].name != other) ++index;
  return add(name, {count}, std::vector<float>(count, static_cast<float>(norms_[index])));
}

const Tensor& ParameterStore::find(std::string_view name) const {
  for (const Parameter& parameter : parameters_) {
    if (parameter.name == name) return parameter.value;
  }
  throw std::logic_error(fmt::format("[parameter_store] no parameter '{}'", name));
}

bool ParameterStore::contains(std::string_view name) const {
  for (const Parameter& parameter : parameters_) {
    if (parameter.name == name) return true;
  }
  return false;
}

int64_t ParameterStore::count() const {
  int64_t total = 0;
  for (const Parameter& parameter : parameters_) total += parameter.value.size();
  return total;
}

std::vector<float> normal_numbers(uint64_t seed, int64_t count) {
  Random random(seed);
  std::vector<float> values(count);
  for (float& value : values) value = static_cast<float>(random.normal());
  return values;
}

}  // namespace degas
