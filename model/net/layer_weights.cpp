#include "model/net/layer_weights.h"

#include <stdexcept>

namespace degas {

size_t LayerWeights::add(const WeightNormLayer& layer) {
  layers_.push_back(layer);
  return layers_.size() - 1;
}

const Tensor& LayerWeights::of(size_t layer) const {
  if (weights_.empty()) throw std::logic_error("[layer_weights] a layer was run before its weights were made");
  return weights_.at(layer);
}

LayerWeights::Pass::Pass(LayerWeights& weights, Tape& tape) : weights_(weights) {
  weights_.weights_ = weight_norm(tape, weights_.layers_);
}

}  // namespace degas
