#include "model/net/encoders.h"

#include <fmt/format.h>

#include <bit>
#include <stdexcept>

#include "host/ops/latent.h"
#include "host/ops/pointwise.h"
#include "host/ops/region.h"

namespace degas {
namespace {

std::vector<int> scaled(std::vector<int> channels, double width) {
  for (int& value : channels) value = scaled_channels(value, width);
  return channels;
}

std::vector<int> posed_vertex_levels(const NetConfig& config) {
  return encoder_levels(config.pve_channels, levels_above_bottleneck(config.resolution), config.width);
}

/// Mask of pose channel c: that of joint c div 3, or by the release's rule c mod J.
Tensor expand_masks(const Tensor& joint_masks, JointMasks rule) {
  const std::vector<float> masks = joint_masks.to_host<float>();
  const int64_t joints = joint_masks.dim(2), channels = 3 * joints, pixels = joint_masks.size() / joints;
  std::vector<float> expanded(pixels * channels, 1.0F);
  for (int64_t p = 0; p < pixels && rule != JointMasks::None; ++p) {
    for (int64_t c = 0; c < channels; ++c) {
      const int64_t joint = rule == JointMasks::Joint ? c / 3 : c % joints;
      expanded[p * channels + c] = masks[p * joints + joint] > 0 ? 1.0F : 0.0F;
    }
  }
  return Tensor::from(joint_masks.device(), {joint_masks.dim(0), joint_masks.dim(1), channels},
                      std::span<const float>(expanded));
}

}  // namespace

std::vector<ResBlock> make_downs(const BlockContext& context, const std::string& name, int channels, int size,
                                 const std::vector<int>& levels) {
  std::vector<ResBlock> downs;
  for (const int next : levels) {
    downs.emplace_back(context, fmt::format("{}.{}", name, downs.size()), ResBlock::Shape{channels, next, size, 3, 2});
    channels = next;
    size /= 2;
  }
  return downs;
}

int levels_above_bottleneck(int size) {
  return std::bit_width(static_cast<unsigned>(size)) - 3;
}

std::vector<int> encoder_levels(const std::vector<int>& channels, int levels, double width) {
  std::vector<int> result(channels.begin(), channels.end() - 1);
  result.resize(levels - 1, channels.back());
  result.push_back(channels.back());
  return scaled(result, width);
}

std::vector<int> decoder_levels(const std::vector<int>& channels, int levels, double width) {
  std::vector<int> result = channels;
  while (static_cast<int>(result.size()) > levels) result.erase(result.begin());
  while (static_cast<int>(result.size()) < levels) result.insert(result.begin(), channels.front());
  return scaled(result, width);
}

VectorMapEncoder::VectorMapEncoder(const BlockContext& context, const std::string& name)
    : downs_(make_downs(context, name, 3, context.config.resolution,
                        scaled(context.config.pvm_channels, context.config.width))),
      channels_(scaled_channels(context.config.pvm_channels.back(), context.config.width)) {}

Tensor VectorMapEncoder::operator()(Tape& tape, const Tensor& vectors) const {
  Tensor map = vectors;
  for (const ResBlock& down : downs_) map = down(tape, map);
  return map;
}

CodeDecoder::CodeDecoder(const BlockContext& context, const std::string& name, int code_size, int first_channels,
                         const std::vector<int>& channels)
    : linear_(context, name + ".linear", code_size, 16 * first_channels, true),
      first_channels_(first_channels),
      channels_(channels.empty() ? first_channels : channels.back()) {
  int size = 4, current = first_channels;
  for (const int next : channels) {
    ups_.emplace_back(context, fmt::format("{}.{}", name, ups_.size()), ResBlock::Shape{current, next, size});
    current = next;
    size *= 2;
  }
}

Tensor CodeDecoder::operator()(Tape& tape, const Tensor& code) const {
  Tensor map = linear_(tape, code.reshaped({1, code.size()})).reshaped({1, 4, 4, first_channels_});
  for (const UpBlock& up : ups_) map = up(tape, map);
  return map;
}

PosedVertexEncoder::PosedVertexEncoder(const BlockContext& context)
    : downs_(make_downs(context, "pve", 3, context.config.resolution, posed_vertex_levels(context.config))),
      latent_size_(scaled_channels(context.config.latent_size, context.config.width)),
      flat_size_(16 * posed_vertex_levels(context.config).back()),
      deviation_weights_(std::make_shared<LayerWeights>()),
      mean_(context, "pve.mean", flat_size_, latent_size_, false),
      log_deviation_({context.store, context.config, deviation_weights_}, "pve.log_deviation", flat_size_,
                     latent_size_, false),
      decoder_(context, "pve_decoder", latent_size_, flat_size_ / 16,
               decoder_levels(context.config.pve_decoder_channels,
                              levels_above_bottleneck(context.config.resolution / 8), context.config.width)) {}

PosedVertexEncoder::Latent PosedVertexEncoder::encode(Tape& tape, const Tensor& posed_vertex_map,
                                                      bool with_deviation) const {
  Tensor map = posed_vertex_map;
  for (const ResBlock& down : downs_) map = down(tape, map);
  const Tensor flat = map.reshaped({1, flat_size_});
  Latent latent{mean_(tape, flat), {}};
  if (with_deviation) {
    const LayerWeights::Pass pass(*deviation_weights_, tape);
    latent.log_deviation = scale(tape, log_deviation_(tape, flat), 0.1);
  }
  return latent;
}

Tensor PosedVertexEncoder::decode(Tape& tape, const Latent& latent, const Tensor& noise) const {
  return decoder_(tape, noise.defined() ? sample_latent(tape, latent.mean, latent.log_deviation, noise) : latent.mean);
}

PoseEmbedding::PoseEmbedding(const BlockContext& context, const Tensor& joint_masks)
    : masks_(expand_masks(joint_masks, context.config.joint_masks)),
      channels_(scaled_channels(context.config.pose_channels, context.config.width)),
      res_(context, "pose",
           {static_cast<int>(masks_.dim(2)), channels_, static_cast<int>(masks_.dim(0)), /*kernel=*/1}) {}

Tensor PoseEmbedding::operator()(Tape& tape, const Tensor& pose) const {
  return res_(tape, tile_masked(tape, pose.reshaped({1, pose.size()}), masks_));
}

}  // namespace degas
