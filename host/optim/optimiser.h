#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/autograd/tensor.h"

namespace degas {

/// How a parameter follows its gradient. The learning rate is about the length of a step in both, however large the
/// gradient is.
enum class UpdateRule {
  Adam,  ///< Kingma & Ba, 2015, with bias correction
  /// Riedmiller & Braun, 1993, in the form that takes nothing back: by the gradient's sign alone. An element's step
  /// grows while the sign stays and shrinks where it turns. For elements that few steps reach and that may have far to
  /// go or hardly at all, as the pose of one frame out of thousands.
  Rprop,
};

struct OptimiserOptions {
  double beta1 = 0.9, beta2 = 0.999;               ///< Adam's decay of the moments
  double epsilon = 1e-15;                          ///< Adam's
  double growth = 1.5, shrinkage = 0.6;            ///< Rprop's factors on an element's step
  double smallest_step = 0.05, largest_step = 10;  ///< Rprop's, in learning rates
  /// A norm over all gradients above clip_above is scaled to clip_to (the method's rule: above 1 to 0.1; the usual
  /// clip has both equal). clip_above 0: gradients are never scaled.
  double clip_above = 1, clip_to = 0.1;
  /// A step whose norm exceeds so many times the largest of late is skipped as one that is not finite is; from the
  /// twentieth step on. What is the largest of late halves in about 70 steps, and doubles at each spike, so that a
  /// change that stays is accepted. 0: none is skipped.
  double spike_limit = 0;
};

/// Updates named parameters by their gradients, entirely on the device: the host queues launches and reads nothing
/// back. A step whose global gradient norm is not finite (in the device's REAL) changes neither parameters nor their
/// state and is counted, and so is a spike. Bit-reproducible.
class Optimiser {
 public:
  struct Parameter {
    std::string name;
    int group;  ///< index into the learning rates of step()
    UpdateRule rule;
    Tensor value;
    /// Of value's shape; zero until the first step. Adam: the moments. Rprop: the last gradient and the step, in
    /// learning rates.
    Tensor first_moment, second_moment;
  };
  struct Counters {
    int applied = 0, skipped = 0, skipped_in_a_row = 0;
    double last_norm = 0;  ///< of the last step, before clipping
    struct Skipped {
      int step = -1;                      ///< number of the call of step(), from 0
      std::string parameter;              ///< the first whose gradient is not finite; the largest where all are
      double norm = 0, largest_norm = 0;  ///< its own, and the largest of late before it
    };
    Skipped last_skipped;  ///< since the start or restore(); step -1: none was
  };
  /// Everything besides moments that a checkpoint needs to go on with the same bits.
  struct Progress {
    Counters counters;
    std::vector<int32_t> applied;            ///< updates of each parameter, in the order of parameters()
    std::optional<double> log_largest_norm;  ///< nothing: not known, as before the first step
  };

  explicit Optimiser(Device& device, const OptimiserOptions& options = {});

  /// Throws std::logic_error when the name is taken. Not after the first step().
  void add(const std::string& name, const Tensor& value, int group = 0, UpdateRule rule = UpdateRule::Adam);
  /// In order of name.
  const std::vector<Parameter>& parameters() const { return parameters_; }

  /// One step on the gradients that the parameters hold; one without a gradient is left alone, its bias correction
  /// too. learning_rates: one per group. Gradients are given back afterwards.
  void step(const std::vector<double>& learning_rates);
  void clear_gradients();

  /// Waits for the device: for progress reports and checkpoints, not for every step.
  Counters counters() const;
  Progress progress() const;
  /// Throws std::logic_error when the number of parameters is another.
  void restore(const Progress& progress);

 private:
  /// Parameters of one group and rule that a launch takes together.
  struct Batch {
    int group;
    UpdateRule rule;
    int blocks;
    std::vector<size_t> members;
  };
  void allocate();
  /// Of those that have a gradient, in their order.
  std::vector<Batch> make_batches() const;
  template <typename Arrays, typename... Arguments>
  void launch_batch(const Kernel& kernel, const Batch& batch, const Arrays& arrays,
                    const Arguments&... arguments) const;

  Device& device_;
  OptimiserOptions options_;
  std::vector<Parameter> parameters_;
  bool started_ = false;
  Tensor partial_, owners_, present_, applied_, bias_, state_, counters_;
};

}  // namespace degas
