#include "model/net/texel_mlp.h"

#include <fmt/format.h>

#include "host/ops/region.h"

namespace degas {

TexelMlp::TexelMlp(Device& device, const NetConfig& config, int pose_size, uint64_t seed)
    : MapNetwork(device, config, seed), pose_size_(pose_size), weights_(std::make_shared<LayerWeights>()) {
  const BlockContext context{store_, config_, weights_};
  const int side = config_.resolution, width = scaled_channels(config_.pvm_channels.back(), config_.width);
  const int hidden = scaled_channels(config_.joint_channels, config_.width);
  features_ = store_.create_uniform("features", {1, side, side, width}, 1);
  const std::vector<float> ones(static_cast<size_t>(side) * static_cast<size_t>(side) * static_cast<size_t>(width), 1);
  ones_ = Tensor::from(device, {side, side, width}, std::span<const float>(ones));
  pose_.emplace_back(context, "pose.0", pose_size, hidden, true);
  pose_.emplace_back(context, "pose.1", hidden, width, false);
  for (const int inputs : {2 * width, hidden, hidden}) {
    ConvLayer::Shape shape{inputs, hidden, 1};
    shape.bias = ConvLayer::Bias::Tied;
    hidden_.emplace_back(context, fmt::format("hidden.{}", hidden_.size()), shape);
  }
  heads_.emplace(context, hidden, 1);
}

HeadMaps TexelMlp::decode(Tape& tape, const Inputs& inputs, std::optional<uint64_t>) const {
  require_input("pose", inputs.pose, pose_size_);
  const LayerWeights::Pass pass(*weights_, tape);
  Tensor embedding = inputs.pose.reshaped({1, pose_size_});
  for (const LinearLayer& layer : pose_) embedding = layer(tape, embedding);
  Tensor map = concat_channels(tape, {features_, tile_masked(tape, embedding, ones_)});
  for (const ConvLayer& layer : hidden_) map = layer(tape, map);
  return (*heads_)(tape, {map, map, map});
}

}  // namespace degas
