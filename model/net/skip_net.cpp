#include "model/net/skip_net.h"

#include <fmt/format.h>

namespace degas {

SkipNet::SkipNet(Device& device, const NetConfig& config, uint64_t seed)
    : MapNetwork(device, config, seed), weights_(std::make_shared<LayerWeights>()) {
  const BlockContext context{store_, config_, weights_};
  const std::vector<int> widths =
      encoder_levels(config_.pve_channels, levels_above_bottleneck(config_.resolution), config_.width);
  downs_ = make_downs(context, "encoder", 3, config_.resolution, widths);
  const std::vector<int> levels =
      decoder_levels(config_.pve_decoder_channels, levels_above_bottleneck(config_.resolution / 8), config_.width);
  int channels = widths.back(), size = 4;
  size_t skip = widths.size() - 1;  // the encoder's map of the side above
  for (const int next : levels) {
    ups_.emplace_back(context, fmt::format("up.{}", ups_.size()), ResBlock::Shape{channels, next, size},
                      widths[--skip]);
    channels = next;
    size *= 2;
  }
  const int feature = scaled_channels(config_.joint_channels, config_.width);
  joint_.emplace(context, "joint", ResBlock::Shape{channels, feature, size});
  decoder_.emplace(BlockContext{store_, config_, std::make_shared<LayerWeights>()}, feature,
                   std::vector<int>{widths[1], widths[0], 0});
}

HeadMaps SkipNet::decode(Tape& tape, const Inputs& inputs, std::optional<uint64_t>) const {
  require_input("posed_vertex_map", inputs.posed_vertex_map, int64_t{3} * config_.resolution * config_.resolution);
  const LayerWeights::Pass pass(*weights_, tape);
  std::vector<Tensor> maps = {inputs.posed_vertex_map};
  for (const ResBlock& down : downs_) maps.push_back(down(tape, maps.back()));
  Tensor map = maps.back();
  size_t skip = maps.size() - 1;
  for (const UpBlock& up : ups_) map = up(tape, map, maps[--skip]);
  return (*decoder_)(tape, (*joint_)(tape, map), nullptr, {maps[2], maps[1], {}});
}

}  // namespace degas
