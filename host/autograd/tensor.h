#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/device/device.h"

namespace degas {

/// Sizes, slowest axis first; images are NHWC.
using Shape = std::vector<int64_t>;

int64_t element_count(const Shape& shape);
std::string to_string(const Shape& shape);

/// What a tensor holds. Real is the device's REAL (float, or double in gradient checks).
enum class Element { Real, Int32, UInt32, UInt64, UInt8 };

/// A dense array in device memory, with its gradient once a backward pass has made one. A handle: copies share
/// memory and gradient. Memory is padded to at least 64 elements' multiple (MemoryPool), so a vector kernel may load
/// and store past the end within its last vector.
class Tensor {
 public:
  Tensor() = default;
  /// Memory from the device's pool, not initialised.
  Tensor(Device& device, Shape shape, Element element = Element::Real);

  static Tensor zeros(Device& device, Shape shape, Element element = Element::Real);
  /// Values are converted to the device's REAL. Throws std::logic_error when the count does not fit the shape.
  static Tensor from(Device& device, Shape shape, std::span<const float> values);
  static Tensor from(Device& device, Shape shape, std::span<const double> values);
  static Tensor from(Device& device, Shape shape, std::span<const int32_t> values);
  static Tensor from(Device& device, Shape shape, std::span<const uint8_t> values);

  bool defined() const { return device_ != nullptr; }
  Device& device() const { return *device_; }
  const Shape& shape() const { return shape_; }
  /// Negative axes count from the end.
  int64_t dim(int axis) const { return shape_[axis < 0 ? shape_.size() + axis : axis]; }
  int64_t size() const { return element_count(shape_); }
  Element element() const { return element_; }
  size_t bytes() const;
  /// Throws std::logic_error for a tensor without_values.
  const Memory& memory() const;
  /// The same, null for an undefined tensor: how a kernel sees an optional buffer that is absent.
  const Memory* device_memory() const { return defined() ? &memory() : nullptr; }

  /// The same memory and gradient under another shape of the same size.
  Tensor reshaped(Shape shape) const;
  /// The same gradient, but no memory: what a backward pass keeps of a tensor whose values it does not read.
  Tensor without_values() const;
  /// How to make the values anew where they are large and cheap to make; the recipe holds what it needs for that.
  void set_recipe(std::function<Tensor()> recipe);
  /// What a backward pass keeps of a tensor whose values it reads through rebuilt(): without_values() given a recipe.
  Tensor kept() const { return recipe_ ? without_values() : *this; }
  /// Itself, or made anew where kept() dropped the values.
  Tensor rebuilt() const { return memory_ || !recipe_ ? *this : (*recipe_)(); }

  /// Waits for the device. Float and double read Real tensors; int32_t reads Int32 and UInt32, and so on.
  template <typename Value>
  std::vector<Value> to_host() const;
  /// Replaces the contents; queued, returns at once.
  void upload(std::span<const float> values);
  void upload(std::span<const double> values);
  void upload(std::span<const int32_t> values);
  void upload(std::span<const uint8_t> values);
  void fill_zero();

  /// Leaves (parameters, refined poses) ask for it themselves; the tape sets it on the outputs of operators.
  bool requires_gradient() const { return gradient_ && gradient_->required; }
  Tensor& set_requires_gradient(bool value = true);
  /// Undefined until a backward pass reaches this tensor.
  bool has_gradient() const { return gradient_ && gradient_->memory; }
  Tensor gradient() const;
  /// Whether others hold the gradient's memory too.
  bool gradient_is_shared() const { return gradient_->memory.use_count() > 1; }
  void set_gradient(const Tensor& gradient);
  void clear_gradient() { gradient_->memory.reset(); }

 private:
  struct Gradient {
    bool required = false;
    std::shared_ptr<Memory> memory;
  };
  Shape shape_;
  Device* device_ = nullptr;
  Element element_ = Element::Real;
  std::shared_ptr<Memory> memory_;
  std::shared_ptr<Gradient> gradient_;
  std::shared_ptr<const std::function<Tensor()>> recipe_;
};

template <>
std::vector<float> Tensor::to_host<float>() const;
template <>
std::vector<double> Tensor::to_host<double>() const;
template <>
std::vector<int32_t> Tensor::to_host<int32_t>() const;
template <>
std::vector<uint32_t> Tensor::to_host<uint32_t>() const;
template <>
std::vector<uint64_t> Tensor::to_host<uint64_t>() const;
template <>
std::vector<uint8_t> Tensor::to_host<uint8_t>() const;
/// Throws std::logic_error, with the operation's name, where the tensors have not equally many elements.
void require_equal_sizes(const char* operation, const Tensor& a, const Tensor& b);

}  // namespace degas
