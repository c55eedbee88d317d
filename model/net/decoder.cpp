#include "model/net/decoder.h"

#include <fmt/format.h>

#include "host/ops/harmonics.h"
#include "host/ops/region.h"

namespace degas {

MapDecoder::MapDecoder(const BlockContext& context, int feature_channels)
    : weights_(context.weights), group_channels_(feature_channels) {
  const NetConfig& config = context.config;
  int size = config.resolution / 8;
  for (const int channels : config.decoder_channels) {
    const int next = scaled_channels(channels, config.width);
    ups_.emplace_back(context, fmt::format("decoder.{}", ups_.size()),
                      ResBlock::Shape{groups * group_channels_, groups * next, size, 3, 1, groups});
    group_channels_ = next;
    size *= 2;
  }
  const auto add_head = [&](const char* name, int channels) {
    ConvLayer::Shape shape{group_channels_, channels};
    shape.out_size = size;
    shape.activation = false;
    heads_.emplace_back(context, name, shape);
  };
  add_head("head.position", 3);
  add_head("head.rotation_scale", 7);
  add_head("head.color_opacity", 4);
  if (config.color_degree > 0) add_head("head.color_harmonics", 3 * harmonic_coefficients(config.color_degree));
}

HeadMaps MapDecoder::operator()(Tape& tape, const Tensor& joint_feature, std::vector<Tensor>* levels) const {
  const LayerWeights::Pass pass(*weights_, tape);
  Tensor map = repeat_channels(tape, joint_feature, groups);
  for (const UpBlock& up : ups_) {
    map = up(tape, map);
    if (levels) levels->push_back(map);
  }
  const std::vector<Tensor> parts = split_channels(tape, map, {group_channels_, group_channels_, group_channels_});
  HeadMaps maps{heads_[0](tape, parts[0]), heads_[1](tape, parts[1]), heads_[2](tape, parts[2]), {}, {}};
  if (heads_.size() > groups) maps.color_harmonics = heads_[3](tape, parts[2]);
  return maps;
}

}  // namespace degas
