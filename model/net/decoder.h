#pragma once

#include <vector>

#include "model/net/blocks.h"

namespace degas {

/// What the network paints into UV space, before gaussians/ turns it into Gaussians.
struct HeadMaps {
  Tensor position_offsets;  ///< (1, R, R, 3) d_mu
  Tensor rotation_scale;    ///< (1, R, R, 7): d_q (w, x, y, z), then d_s
  Tensor color_opacity;     ///< (1, R, R, 4): colour, then the opacity's logit
  Tensor color_harmonics;   ///< (1, R, R, 3 K), coefficient by coefficient; only where net.color_degree is above 0
  Tensor divergence;        ///< (1): mean divergence of z from a unit Gaussian; only where net.kl_weight asks for it
};

/// Joint feature (1, R/8, R/8, C) -> head maps. Three groups of channels, one for each head, that never mix.
class MapDecoder {
 public:
  /// context.weights: its own layers' alone.
  MapDecoder(const BlockContext& context, int feature_channels);
  /// levels: filled with the maps of sides R/4, R/2 and R, where given.
  HeadMaps operator()(Tape& tape, const Tensor& joint_feature, std::vector<Tensor>* levels = nullptr) const;

  static constexpr int groups = 3;

 private:
  std::shared_ptr<LayerWeights> weights_;
  std::vector<UpBlock> ups_;
  std::vector<ConvLayer> heads_;
  int group_channels_;
};

}  // namespace degas
