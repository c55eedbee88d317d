#include "model/net/decoder.h"

#include <fmt/format.h>

#include "host/ops/region.h"

namespace degas {

MapDecoder::MapDecoder(const BlockContext& context, int feature_channels, const std::vector<int>& skip_channels)
    : weights_(context.weights), group_channels_(feature_channels) {
  const NetConfig& config = context.config;
  int size = config.resolution / 8;
  for (const int channels : config.decoder_channels) {
    const int next = scaled_channels(channels, config.width);
    ups_.emplace_back(context, fmt::format("decoder.{}", ups_.size()),
                      ResBlock::Shape{groups * group_channels_, groups * next, size, 3, 1, groups},
                      skip_channels[ups_.size()]);
    group_channels_ = next;
    size *= 2;
  }
  heads_.emplace(context, group_channels_, 3);
}

HeadMaps MapDecoder::operator()(Tape& tape, const Tensor& joint_feature, std::vector<Tensor>* levels,
                                const std::vector<Tensor>& skips) const {
  const LayerWeights::Pass pass(*weights_, tape);
  Tensor map = repeat_channels(tape, joint_feature, groups);
  for (size_t i = 0; i < ups_.size(); ++i) {
    map = ups_[i](tape, map, skips[i]);
    if (levels) levels->push_back(map);
  }
  const std::vector<Tensor> parts = split_channels(tape, map, {group_channels_, group_channels_, group_channels_});
  return (*heads_)(tape, {parts[0], parts[1], parts[2]});
}

}  // namespace degas
