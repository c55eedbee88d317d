#pragma once

#include <optional>
#include <vector>

#include "model/net/heads.h"

namespace degas {

/// Joint feature (1, R/8, R/8, C) -> head maps. Three groups of channels, one for each head, that never mix.
class MapDecoder {
 public:
  /// context.weights: its own layers' alone. skip_channels: of the maps that stand beside the enlarged ones of sides
  /// R/4, R/2 and R; 0, and by default everywhere, where none does.
  MapDecoder(const BlockContext& context, int feature_channels, const std::vector<int>& skip_channels = {0, 0, 0});
  /// levels: filled with the maps of sides R/4, R/2 and R, where given. skips: the maps that skip_channels tells of.
  HeadMaps operator()(Tape& tape, const Tensor& joint_feature, std::vector<Tensor>* levels = nullptr,
                      const std::vector<Tensor>& skips = {{}, {}, {}}) const;

  static constexpr int groups = 3;

 private:
  std::shared_ptr<LayerWeights> weights_;
  std::vector<UpBlock> ups_;
  int group_channels_;
  std::optional<Heads> heads_;
};

}  // namespace degas
