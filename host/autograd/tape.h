#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host/autograd/tensor.h"

namespace degas {

/// Records how outputs came from inputs and walks back. An operator computes its output, then calls record() with a
/// lambda that turns the output's gradient into its inputs' through accumulate(). One tape serves one step:
///
///   Tape tape(device);
///   Tensor loss = mean(tape, lrelu(tape, x, 0.2));
///   tape.backward(loss);          // x.gradient() now holds d loss / d x
class Tape {
 public:
  /// recording = false: operators only compute (evaluation); nothing is kept alive for a backward pass.
  explicit Tape(Device& device, bool recording = true) : device_(device), recording_(recording) {}

  Device& device() const { return device_; }
  bool recording() const { return recording_; }
  /// Whether an operator should keep what its backward needs.
  bool needs_gradient(const std::vector<Tensor>& inputs) const;

  /// Marks the outputs as requiring a gradient when an input does, and keeps backward for the walk back. It runs once,
  /// if any output has received a gradient; an output that has not gives an undefined gradient() there
  /// (gradient_or_zeros for kernels that want an array).
  void record(const char* operation, const std::vector<Tensor>& inputs, std::vector<Tensor> outputs,
              std::function<void(Tape&)> backward);

  /// Adds to target's gradient what `write` stores into the tensor it is given (of target's shape, uninitialised; every
  /// element must be written). Does nothing when target wants no gradient.
  void accumulate(const Tensor& target, const std::function<void(const Tensor&)>& write);
  /// Adds what is there already, of target's size; undefined: nothing. Targets may share it: a gradient that others
  /// hold is never written to.
  void accumulate(const Tensor& target, const Tensor& contribution);
  Tensor gradient_or_zeros(const Tensor& output) const;
  /// The same to be written to.
  Tensor own_gradient_or_zeros(const Tensor& output) const;

  /// loss: one element. Gradients of leaves add to what they hold already; those of intermediate tensors are given
  /// back to the pool as soon as they are used, and the tape is empty afterwards.
  void backward(const Tensor& loss);
  /// The same from any tensors of this tape and their gradients, of the same shapes.
  void backward(const std::vector<Tensor>& outputs, std::vector<Tensor> gradients);

  size_t length() const { return steps_.size(); }

 private:
  struct Step {
    const char* operation;
    Stage stage;  // of the forward pass: the profile counts the backward to it
    std::vector<Tensor> outputs;
    std::function<void(Tape&)> backward;
  };
  void walk_back();
  Device& device_;
  bool recording_;
  std::vector<Step> steps_;
};

}  // namespace degas
