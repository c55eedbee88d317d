#pragma once

#include <vector>

#include "host/ops/weight_norm.h"

namespace degas {

/// The normalised weights of layers that run together, made in few launches before them.
class LayerWeights {
 public:
  /// Returns the number of the layer.
  size_t add(const WeightNormLayer& layer);
  /// Throws std::logic_error outside a Pass.
  const Tensor& of(size_t layer) const;

  /// Makes the weights; at its end only the tape keeps those that its way back reads.
  class Pass {
   public:
    Pass(LayerWeights& weights, Tape& tape);
    ~Pass() { weights_.weights_.clear(); }
    Pass(const Pass&) = delete;
    Pass& operator=(const Pass&) = delete;

   private:
    LayerWeights& weights_;
  };

 private:
  std::vector<WeightNormLayer> layers_;
  std::vector<Tensor> weights_;
};

}  // namespace degas
