#pragma once

#include "model/net/map_network.h"

namespace degas {

/// net.kind static, Gaussians bound to the mesh (SplattingAvatar, GaussianAvatars): the maps themselves are the
/// parameters, the same for every pose and face.
class StaticMaps : public MapNetwork {
 public:
  StaticMaps(Device& device, const NetConfig& config, uint64_t seed);
  HeadMaps decode(Tape& tape, const Inputs& inputs, std::optional<uint64_t> noise_seed = {}) const override;

 private:
  std::vector<Tensor> maps_;
};

}  // namespace degas
