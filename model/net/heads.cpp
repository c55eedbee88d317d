#include "model/net/heads.h"

#include <cmath>

#include "host/ops/harmonics.h"
#include "host/ops/pointwise.h"
#include "host/ops/region.h"

namespace degas {

std::vector<Head> heads_of(const NetConfig& config) {
  std::vector<Head> heads = {{"position", 3, 0},
                             {"rotation_scale", config.isotropic ? 1 : 7, 1},
                             {"color_opacity", config.isotropic ? 3 : 4, 2}};
  if (config.color_degree > 0) {
    heads.push_back({"color_harmonics", 3 * harmonic_coefficients(config.color_degree), 2});
  }
  return heads;
}

HeadMaps head_maps(Tape& tape, const NetConfig& config, const std::vector<Tensor>& heads) {
  HeadMaps maps{heads[0], heads[1], heads[2], heads.size() > 3 ? heads[3] : Tensor(), {}};
  if (!config.isotropic) return maps;
  const int64_t side = config.resolution;
  Tape silent(tape.device(), false);
  const Tensor no_rotation = Tensor::zeros(tape.device(), {1, side, side, 4});
  const Tensor opacity = scale(silent, Tensor::zeros(tape.device(), {1, side, side, 1}), 0,
                               std::log(isotropic_opacity / (1 - isotropic_opacity)));
  maps.rotation_scale = concat_channels(tape, {no_rotation, repeat_channels(tape, heads[1], 3)});
  maps.color_opacity = concat_channels(tape, {heads[2], opacity});
  return maps;
}

Heads::Heads(const BlockContext& context, int channels, int kernel) : config_(context.config) {
  for (const Head& head : heads_of(config_)) {
    ConvLayer::Shape shape{channels, head.channels, kernel};
    shape.out_size = config_.resolution;
    shape.activation = false;
    layers_.emplace_back(context, std::string("head.") + head.name, shape);
  }
}

HeadMaps Heads::operator()(Tape& tape, const std::array<Tensor, 3>& features) const {
  const std::vector<Head> heads = heads_of(config_);
  std::vector<Tensor> maps;
  for (size_t i = 0; i < layers_.size(); ++i) {
    maps.push_back(layers_[i](tape, features[static_cast<size_t>(heads[i].group)]));
  }
  return head_maps(tape, config_, maps);
}

}  // namespace degas
