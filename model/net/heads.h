#pragma once

#include <array>
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

/// A map that a network makes: its name, channels, and the decoder's group that it is made of (0 position, 1 rotation
/// and scale, 2 colour and opacity).
struct Head {
  const char* name;
  int channels;
  int group;
};
std::vector<Head> heads_of(const NetConfig& config);

/// The heads' maps, in the order of heads_of, as HeadMaps. With net.isotropic one scale stands for three, rotations
/// stay the base's and the opacity is fixed.
HeadMaps head_maps(Tape& tape, const NetConfig& config, const std::vector<Tensor>& heads);

/// The opacity of net.isotropic: nearly opaque, below where the rasteriser clamps and gradients end.
constexpr double isotropic_opacity = 0.98;

/// The last convolution of each head.
class Heads {
 public:
  /// channels: of each group's features, of side R. kernel: 1 or 3.
  Heads(const BlockContext& context, int channels, int kernel);
  HeadMaps operator()(Tape& tape, const std::array<Tensor, 3>& features) const;

 private:
  NetConfig config_;
  std::vector<ConvLayer> layers_;
};

}  // namespace degas
