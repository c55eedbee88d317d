#include "host/autograd/tensor.h"

#include <fmt/ranges.h>

#include <numeric>
#include <stdexcept>

namespace degas {
namespace {

size_t element_bytes(const Device& device, Element element) {
  switch (element) {
    case Element::Real:
      return device.real_bytes();
    case Element::UInt64:
      return 8;
    case Element::UInt8:
      return 1;
    default:
      return 4;
  }
}

template <typename Value>
void require_count(const Shape& shape, std::span<const Value> values) {
  if (static_cast<int64_t>(values.size()) != element_count(shape)) {
    throw std::logic_error(fmt::format("[tensor] {} values for shape {}", values.size(), to_string(shape)));
  }
}

template <typename From>
void upload_real(const Tensor& target, std::span<const From> values) {
  require_count(target.shape(), values);
  Device& device = target.device();
  if (device.real_bytes() == sizeof(From)) return device.upload(target.memory(), values.data(), values.size_bytes());
  if constexpr (sizeof(From) == 4) {
    const std::vector<double> converted(values.begin(), values.end());
    device.upload(target.memory(), converted.data(), converted.size() * sizeof(double));
  } else {
    const std::vector<float> converted(values.begin(), values.end());
    device.upload(target.memory(), converted.data(), converted.size() * sizeof(float));
  }
}

template <typename Value>
std::vector<Value> download_as(const Tensor& source) {
  std::vector<Value> values(source.size());
  source.device().download(source.memory(), values.data(), values.size() * sizeof(Value));
  return values;
}

}  // namespace

int64_t element_count(const Shape& shape) {
  return std::accumulate(shape.begin(), shape.end(), int64_t{1}, std::multiplies<>());
}

std::string to_string(const Shape& shape) {
  return fmt::format("({})", fmt::join(shape, ", "));
}

Tensor::Tensor(Device& device, Shape shape, Element element)
    : shape_(std::move(shape)),
      device_(&device),
      element_(element),
      memory_(device.allocate(element_count(shape_) * element_bytes(device, element))),
      gradient_(std::make_shared<Gradient>()) {}

Tensor Tensor::zeros(Device& device, Shape shape, Element element) {
  Tensor tensor(device, std::move(shape), element);
  tensor.fill_zero();
  return tensor;
}

Tensor Tensor::from(Device& device, Shape shape, std::span<const float> values) {
  Tensor tensor(device, std::move(shape));
  tensor.upload(values);
  return tensor;
}
Tensor Tensor::from(Device& device, Shape shape, std::span<const double> values) {
  Tensor tensor(device, std::move(shape));
  tensor.upload(values);
  return tensor;
}
Tensor Tensor::from(Device& device, Shape shape, std::span<const int32_t> values) {
  Tensor tensor(device, std::move(shape), Element::Int32);
  tensor.upload(values);
  return tensor;
}
Tensor Tensor::from(Device& device, Shape shape, std::span<const uint8_t> values) {
  Tensor tensor(device, std::move(shape), Element::UInt8);
  tensor.upload(values);
  return tensor;
}

size_t Tensor::bytes() const {
  return size() * element_bytes(device(), element());
}

Tensor Tensor::reshaped(Shape shape) const {
  if (element_count(shape) != size()) {
    throw std::logic_error(fmt::format("[tensor] {} does not reshape to {}", to_string(shape_), to_string(shape)));
  }
  Tensor view = *this;
  view.shape_ = std::move(shape);
  view.recipe_.reset();  // it makes the other shape
  return view;
}

const Memory& Tensor::memory() const {
  if (!memory_) throw std::logic_error(fmt::format("[tensor] the values of {} were given back", to_string(shape_)));
  return *memory_;
}

Tensor Tensor::without_values() const {
  Tensor rest = *this;
  rest.memory_.reset();
  return rest;
}

void Tensor::set_recipe(std::function<Tensor()> recipe) {
  recipe_ = std::make_shared<const std::function<Tensor()>>(std::move(recipe));
}

template <>
std::vector<float> Tensor::to_host<float>() const {
  if (device().real_bytes() == 4) return download_as<float>(*this);
  const std::vector<double> values = download_as<double>(*this);
  return {values.begin(), values.end()};
}
template <>
std::vector<double> Tensor::to_host<double>() const {
  if (device().real_bytes() == 8) return download_as<double>(*this);
  const std::vector<float> values = download_as<float>(*this);
  return {values.begin(), values.end()};
}
template <>
std::vector<int32_t> Tensor::to_host<int32_t>() const {
  return download_as<int32_t>(*this);
}
template <>
std::vector<uint32_t> Tensor::to_host<uint32_t>() const {
  return download_as<uint32_t>(*this);
}
template <>
std::vector<uint64_t> Tensor::to_host<uint64_t>() const {
  return download_as<uint64_t>(*this);
}
template <>
std::vector<uint8_t> Tensor::to_host<uint8_t>() const {
  return download_as<uint8_t>(*this);
}

void Tensor::upload(std::span<const float> values) {
  upload_real(*this, values);
}
void Tensor::upload(std::span<const double> values) {
  upload_real(*this, values);
}
void Tensor::upload(std::span<const int32_t> values) {
  require_count(shape_, values);
  device().upload(memory(), values.data(), values.size_bytes());
}
void Tensor::upload(std::span<const uint8_t> values) {
  require_count(shape_, values);
  device().upload(memory(), values.data(), values.size_bytes());
}

void Tensor::fill_zero() {
  device().fill(memory(), 0, bytes());
}

Tensor& Tensor::set_requires_gradient(bool value) {
  gradient_->required = value;
  return *this;
}

Tensor Tensor::gradient() const {
  Tensor result;
  if (!has_gradient()) return result;
  result.shape_ = shape_;
  result.device_ = device_;
  result.memory_ = gradient_->memory;
  result.gradient_ = std::make_shared<Gradient>();
  return result;
}

void Tensor::set_gradient(const Tensor& gradient) {
  gradient_->memory = gradient.memory_;
}

void require_equal_sizes(const char* operation, const Tensor& a, const Tensor& b) {
  if (a.size() != b.size()) {
    throw std::logic_error(
        fmt::format("[{}] sizes differ: {} and {}", operation, to_string(a.shape()), to_string(b.shape())));
  }
}

}  // namespace degas
