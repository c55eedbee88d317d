#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/net/blocks.h"

namespace degas {

/// Channel counts of `levels` steps between side 4 and a larger side, out of the paper's list for R = 512, scaled by
/// width. Encoders (down to side 4) keep the list's last entry, the bottleneck, and drop or repeat what comes just
/// before it; decoders (up from side 4) keep the list's end and drop or repeat its first entry.
std::vector<int> encoder_levels(const std::vector<int>& channels, int levels, double width);
std::vector<int> decoder_levels(const std::vector<int>& channels, int levels, double width);

/// log2(size / 4): halvings from `size` to the bottleneck's side of 4.
int levels_above_bottleneck(int size);

/// Down blocks named name.0 and so on, from `channels` at side `size` to the channels of `levels`.
std::vector<ResBlock> make_downs(const BlockContext& context, const std::string& name, int channels, int size,
                                 const std::vector<int>& levels);

/// Convolutions down to R / 8 of a map of vectors on the surface, the posed vertices or the world's normals:
/// (1, R, R, 3) -> (1, R/8, R/8, pvm_channels.back()).
class VectorMapEncoder {
 public:
  VectorMapEncoder(const BlockContext& context, const std::string& name);
  Tensor operator()(Tape& tape, const Tensor& vectors) const;
  int channels() const { return channels_; }

 private:
  std::vector<ResBlock> downs_;
  int channels_;
};

/// A stack of Up blocks from a code: linear with leaky ReLU to (1, 4, 4, first), then up to `out_size`.
class CodeDecoder {
 public:
  CodeDecoder(const BlockContext& context, const std::string& name, int code_size, int first_channels,
              const std::vector<int>& channels);
  Tensor operator()(Tape& tape, const Tensor& code) const;
  int channels() const { return channels_; }

 private:
  LinearLayer linear_;
  std::vector<UpBlock> ups_;
  int first_channels_, channels_;
};

/// The variational branch: posed vertex map -> latent z -> (1, R/8, R/8, pve_decoder_channels.back()).
class PosedVertexEncoder {
 public:
  explicit PosedVertexEncoder(const BlockContext& context);
  struct Latent {
    Tensor mean;           ///< (1, latent_size)
    Tensor log_deviation;  ///< the same, 0.1 times its layer's output; undefined unless asked for
  };
  Latent encode(Tape& tape, const Tensor& posed_vertex_map, bool with_deviation) const;
  /// noise: (1, latent_size), already scaled; undefined: z is the mean.
  Tensor decode(Tape& tape, const Latent& latent, const Tensor& noise) const;
  int latent_size() const { return latent_size_; }
  int channels() const { return decoder_.channels(); }

 private:
  std::vector<ResBlock> downs_;
  int latent_size_, flat_size_;
  std::shared_ptr<LayerWeights> deviation_weights_;  ///< of log_deviation_ alone, which few configs run
  LinearLayer mean_, log_deviation_;
  CodeDecoder decoder_;
};

/// Pose angles tiled over the texels of their joints, then a 1x1 Res: (3 J) -> (1, R/8, R/8, pose_channels).
class PoseEmbedding {
 public:
  /// joint_masks: (R/8, R/8, J), not 0 where joint 1 + j moves the texel.
  PoseEmbedding(const BlockContext& context, const Tensor& joint_masks);
  Tensor operator()(Tape& tape, const Tensor& pose) const;
  int channels() const { return channels_; }

 private:
  Tensor masks_;  ///< (R/8, R/8, 3 J)
  int channels_;
  ResBlock res_;
};

}  // namespace degas
