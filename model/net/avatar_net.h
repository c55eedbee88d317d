#pragma once

#include <cstdint>
#include <optional>

#include "model/net/decoder.h"
#include "model/net/encoders.h"
#include "model/net/map_network.h"

namespace degas {

/// The network of method.md: driving signals -> joint feature -> head maps.
///
/// Sizes at any resolution R: the joint feature has side R/8 and the face map R/16, both decoders start at side 4, and
/// the posed-vertex encoder ends there; the lists of channels, given for R = 512, are cut or extended as encoder_levels
/// and decoder_levels say. The face map replaces the face region of each map: in SMPL-X's UV layout the top-left quarter.
/// Where every map is switched off, a trained constant stands in their place. The world's normals join behind the face
/// map, which does not cover them: the light falls on the face as on the rest.
class AvatarNet : public MapNetwork {
 public:
  struct Encoding {
    Tensor joint_feature;  ///< (1, R/8, R/8, joint_channels)
    Tensor divergence;     ///< as HeadMaps::divergence
  };

  /// face_code_size: 0 leaves the face code out. joint_masks: (R/8, R/8, J), positive where joint 1 + j moves the texel;
  /// throws Error when it does not fit R. face_region: where the head lies in the UV layout.
  AvatarNet(Device& device, const NetConfig& config, int face_code_size, const Tensor& joint_masks, uint64_t seed,
            const FaceRegion& face_region = {});

  HeadMaps decode(Tape& tape, const Inputs& inputs, std::optional<uint64_t> noise_seed = {}) const override;

  /// The two halves of decode: nothing but the joint feature passes between them.
  Encoding encode(Tape& tape, const Inputs& inputs, std::optional<uint64_t> noise_seed = {}) const;
  HeadMaps decode_feature(Tape& tape, const Tensor& joint_feature, std::vector<Tensor>* levels = nullptr) const;

 private:
  Tensor inject_face(Tape& tape, const Tensor& map, const Tensor& face_map) const;

  int face_code_size_;
  FaceRegion face_region_;
  std::shared_ptr<LayerWeights> encoder_weights_;
  std::optional<PoseEmbedding> pose_;
  std::optional<VectorMapEncoder> posed_vertex_map_;
  std::optional<PosedVertexEncoder> posed_vertex_;
  std::optional<VectorMapEncoder> world_normals_;
  std::optional<CodeDecoder> face_;
  Tensor constant_;
  std::optional<ResBlock> joint_;
  std::optional<MapDecoder> decoder_;
};

}  // namespace degas
