#include "model/net/avatar_net.h"

#include "host/error.h"
#include "host/ops/latent.h"
#include "host/ops/reduction.h"
#include "host/ops/region.h"

namespace degas {
AvatarNet::AvatarNet(Device& device, const NetConfig& config, int face_code_size, const Tensor& joint_masks,
                     uint64_t seed, const FaceRegion& face_region)
    : MapNetwork(device, config, seed),
      face_code_size_(face_code_size),
      face_region_(face_region),
      encoder_weights_(std::make_shared<LayerWeights>()) {
  const BlockContext context{store_, config_, encoder_weights_};
  const int side = config_.resolution / 8;
  const auto scaled = [&](int channels) { return scaled_channels(channels, config_.width); };

  int channels = 0;
  if (config_.use_pose_embedding) {
    if (joint_masks.shape().size() != 3 || joint_masks.dim(0) != side || joint_masks.dim(1) != side) {
      throw Error::format("net.resolution {}: joint masks must be {} x {} texels, got {}", config_.resolution, side,
                          side, to_string(joint_masks.shape()));
    }
    channels += pose_.emplace(context, joint_masks).channels();
  }
  if (config_.use_pvm) channels += posed_vertex_map_.emplace(context, "pvm").channels();
  if (config_.use_pve) channels += posed_vertex_.emplace(context).channels();
  if (face_code_size_ > 0) {
    const std::vector<int> levels =
        decoder_levels(config_.face_channels, levels_above_bottleneck(config_.resolution / 16), config_.width);
    face_.emplace(context, "face", face_code_size, scaled(config_.face_start_channels), levels);
  }
  if (channels == 0) {
    channels = scaled(config_.pose_channels) + scaled(config_.pvm_channels.back()) +
               scaled(config_.pve_decoder_channels.back());
    constant_ = store_.create_uniform("constant", {1, side, side, channels}, 1);
  }
  if (config_.use_world_normals) channels += world_normals_.emplace(context, "world_normals").channels();
  joint_.emplace(context, "joint", ResBlock::Shape{channels, scaled(config_.joint_channels), side});
  decoder_.emplace(BlockContext{store_, config_, std::make_shared<LayerWeights>()}, scaled(config_.joint_channels));
}

Tensor AvatarNet::inject_face(Tape& tape, const Tensor& map, const Tensor& face_map) const {
  if (!face_map.defined()) return map;
  const int side = config_.resolution / 8;
  return overwrite_region(tape, map, face_map, face_region_.top(side), face_region_.left(side));
}

AvatarNet::Encoding AvatarNet::encode(Tape& tape, const Inputs& inputs, std::optional<uint64_t> noise_seed) const {
  const int64_t map_size = int64_t{3} * config_.resolution * config_.resolution;
  if (posed_vertex_map_ || posed_vertex_) require_input("posed_vertex_map", inputs.posed_vertex_map, map_size);
  if (world_normals_) require_input("world_normals", inputs.world_normals, map_size);
  const LayerWeights::Pass pass(*encoder_weights_, tape);
  Tensor face_map;
  if (face_) {
    require_input("face_code", inputs.face_code, face_code_size_);
    face_map = (*face_)(tape, inputs.face_code);
  }
  Encoding encoding;
  std::vector<Tensor> maps;
  if (pose_) maps.push_back(inject_face(tape, (*pose_)(tape, inputs.pose), face_map));
  if (posed_vertex_map_) {
    maps.push_back(inject_face(tape, (*posed_vertex_map_)(tape, inputs.posed_vertex_map), face_map));
  }
  if (posed_vertex_) {
    const bool with_noise = noise_seed && config_.noise_std > 0, with_divergence = noise_seed && config_.kl_weight > 0;
    const auto latent = posed_vertex_->encode(tape, inputs.posed_vertex_map, with_noise || with_divergence);
    Tensor noise;
    if (with_noise) {
      std::vector<float> values = normal_numbers(*noise_seed, posed_vertex_->latent_size());
      for (float& value : values) value *= static_cast<float>(config_.noise_std);
      noise = Tensor::from(tape.device(), latent.mean.shape(), std::span<const float>(values));
    }
    if (with_divergence) encoding.divergence = mean(tape, unit_divergence(tape, latent.mean, latent.log_deviation));
    maps.push_back(inject_face(tape, posed_vertex_->decode(tape, latent, noise), face_map));
  }
  if (constant_.defined()) maps.push_back(inject_face(tape, constant_, face_map));
  if (world_normals_) maps.push_back((*world_normals_)(tape, inputs.world_normals));
  encoding.joint_feature = (*joint_)(tape, concat_channels(tape, maps));
  return encoding;
}

HeadMaps AvatarNet::decode_feature(Tape& tape, const Tensor& joint_feature, std::vector<Tensor>* levels) const {
  return (*decoder_)(tape, joint_feature, levels);
}

HeadMaps AvatarNet::decode(Tape& tape, const Inputs& inputs, std::optional<uint64_t> noise_seed) const {
  const Encoding encoding = encode(tape, inputs, noise_seed);
  HeadMaps maps = decode_feature(tape, encoding.joint_feature);
  maps.divergence = encoding.divergence;
  return maps;
}

}  // namespace degas
