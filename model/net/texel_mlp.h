#pragma once

#include "model/net/map_network.h"

namespace degas {

/// net.kind mlp, a network per Gaussian (3DGS-Avatar): each texel has trained features, which go through three hidden
/// layers beside an embedding of the whole body's pose, the same for all texels. 1x1 convolutions with tied biases; the
/// heads' untied ones are what a Gaussian has of its own in every pose. Features and embedding are as wide as
/// net.pvm_channels' last, hidden layers as net.joint_channels.
class TexelMlp : public MapNetwork {
 public:
  /// pose_size: 3 J.
  TexelMlp(Device& device, const NetConfig& config, int pose_size, uint64_t seed);
  HeadMaps decode(Tape& tape, const Inputs& inputs, std::optional<uint64_t> noise_seed = {}) const override;

 private:
  int pose_size_;
  std::shared_ptr<LayerWeights> weights_;
  Tensor features_;  ///< (1, R, R, C)
  Tensor ones_;      ///< (R, R, C)
  std::vector<LinearLayer> pose_;
  std::vector<ConvLayer> hidden_;
  std::optional<Heads> heads_;
};

}  // namespace degas
