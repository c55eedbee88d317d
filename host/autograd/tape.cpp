#include "host/autograd/tape.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace degas {
namespace {

/// sum = a + b; sum may be a. Launched from here, because operators stand on the tape and not the tape on operators.
void add_into(const Tensor& sum, const Tensor& a, const Tensor& b) {
  if (a.size() != b.size()) {
    throw std::logic_error(
        fmt::format("[tape] gradient of shape {} for shape {}", to_string(b.shape()), to_string(a.shape())));
  }
  Device& device = sum.device();
  device.kernel("pointwise", "add")
      .launch(device.pointwise_global(sum.size()), device.pointwise_local(), a, b, sum, sum.size());
}

}  // namespace

bool Tape::needs_gradient(const std::vector<Tensor>& inputs) const {
  return recording_ && std::any_of(inputs.begin(), inputs.end(), [](const Tensor& t) { return t.requires_gradient(); });
}

void Tape::record(const char* operation, const std::vector<Tensor>& inputs, std::vector<Tensor> outputs,
                  std::function<void(Tape&)> backward) {
  if (!needs_gradient(inputs)) return;
  for (Tensor& output : outputs) output = output.set_requires_gradient().without_values();
  steps_.push_back({operation, device_.stage(), std::move(outputs), std::move(backward)});
}

void Tape::accumulate(const Tensor& target, const std::function<void(const Tensor&)>& write) {
  if (!target.requires_gradient()) return;
  const Tensor contribution(device_, target.shape());
  write(contribution);
  accumulate(target, contribution);
}

void Tape::accumulate(const Tensor& target, const Tensor& contribution) {
  if (!target.requires_gradient() || !contribution.defined()) return;
  if (!target.has_gradient()) {
    Tensor(target).set_gradient(contribution);
  } else if (target.gradient_is_shared()) {
    const Tensor sum(device_, target.shape());
    add_into(sum, target.gradient(), contribution);
    Tensor(target).set_gradient(sum);
  } else {
    add_into(target.gradient(), target.gradient(), contribution);
  }
}

Tensor Tape::gradient_or_zeros(const Tensor& output) const {
  return output.has_gradient() ? output.gradient() : Tensor::zeros(device_, output.shape());
}

Tensor Tape::own_gradient_or_zeros(const Tensor& output) const {
  if (!output.has_gradient() || !output.gradient_is_shared()) return gradient_or_zeros(output);
  const Tensor copy(device_, output.shape());
  device_.copy(output.gradient().memory(), copy.memory(), copy.bytes());
  return copy;
}

void Tape::backward(const Tensor& loss) {
  if (loss.size() != 1) {
    throw std::logic_error(fmt::format("[tape] backward needs one number, got shape {}", to_string(loss.shape())));
  }
  const double one = 1;
  Tensor(loss).set_gradient(Tensor::from(device_, loss.shape(), std::span<const double>(&one, 1)));
  walk_back();
}

void Tape::backward(const std::vector<Tensor>& outputs, std::vector<Tensor> gradients) {
  for (size_t i = 0; i < outputs.size(); ++i) accumulate(outputs[i], gradients.at(i));
  gradients.clear();  // held here, they would count as shared and be copied before every write
  walk_back();
}

void Tape::walk_back() {
  while (!steps_.empty()) {
    // Popping as we go gives each step's tensors back to the pool while the walk continues.
    Step step = std::move(steps_.back());
    steps_.pop_back();
    const bool reached = std::any_of(step.outputs.begin(), step.outputs.end(),
                                     [](const Tensor& output) { return output.has_gradient(); });
    device_.set_stage({step.stage.name, true});
    if (reached) step.backward(*this);
    for (Tensor& output : step.outputs) output.clear_gradient();
  }
}

}  // namespace degas
