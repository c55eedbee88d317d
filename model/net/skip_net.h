#pragma once

#include "model/net/decoder.h"
#include "model/net/encoders.h"
#include "model/net/map_network.h"

namespace degas {

/// net.kind skips, an encoder-decoder of the posed vertex map (AnimatableGaussians): Down blocks to side 4
/// (net.pve_channels), Up blocks to R/8 (net.pve_decoder_channels), the joint Res and the three groups of MapDecoder.
/// Every enlarged map has the encoder's of its side beside it, up to R/2, in each group.
class SkipNet : public MapNetwork {
 public:
  SkipNet(Device& device, const NetConfig& config, uint64_t seed);
  HeadMaps decode(Tape& tape, const Inputs& inputs, std::optional<uint64_t> noise_seed = {}) const override;

 private:
  std::shared_ptr<LayerWeights> weights_;
  std::vector<ResBlock> downs_;  ///< outputs of sides R/2 .. 4
  std::vector<UpBlock> ups_;     ///< outputs of sides 8 .. R/8
  std::optional<ResBlock> joint_;
  std::optional<MapDecoder> decoder_;
};

}  // namespace degas
