#pragma once

#include <vector>

#include "host/autograd/tape.h"

namespace degas {

/// A layer's numbers as torch stores them, before the equalised scale: a convolution's weight (Cout,Cin,K,K) or a
/// linear layer's (Out,In), and a bias per output, or none.
struct EncoderLayer {
  Shape shape;
  std::vector<float> weight, bias;
};

/// What an ExpressionEncoder is made of. Every size is read from here; DPE's own are in brackets.
struct ExpressionEncoderWeights {
  struct Block {
    EncoderLayer first;   ///< 3x3, C -> C
    EncoderLayer second;  ///< 3x3 at stride 2, C -> C'
    EncoderLayer skip;    ///< 1x1 at stride 2, C -> C', no bias
  };
  EncoderLayer input;                      ///< 1x1, 3 -> C [64]
  std::vector<Block> blocks;               ///< each halves the side [128, 256, 512, 512, 512, 512: from 256 to 4]
  EncoderLayer output;                     ///< 4x4 without padding or bias, C -> D [512]
  std::vector<EncoderLayer> coefficients;  ///< linear layers, D -> M motion coefficients [20]
  EncoderLayer basis;                      ///< (D,M), no bias: its columns are made orthonormal
  std::vector<EncoderLayer> code;          ///< linear layers, D -> code [three, 512]
};

/// The expression encoder of DPE (Pang et al., CVPR 2023), which is that of the Latent Image Animator (Wang et al.,
/// ICLR 2022) and three linear layers, from the building blocks of StyleGAN2 (Karras et al. 2020). Frozen: gradients
/// reach the image only.
///
///   equalised   w / sqrt(fan-in), the weights themselves being of unit variance
///   activation  sqrt(2) leaky_relu(x + bias, 0.2)
///   blur        depthwise [1,3,3,1] x [1,3,3,1] / 64 before each convolution of stride 2, padded so that the side
///   halves block       (second(first(x)) + skip(x)) / sqrt(2), an activation after first and second code linear(Q
///   linear(features)), Q being the first factor of the basis' QR decomposition
class ExpressionEncoder {
 public:
  /// Throws std::logic_error when layers do not fit each other.
  ExpressionEncoder(Device& device, const ExpressionEncoderWeights& weights);

  /// images: (N, side, side, 3) RGB in -1 .. 1. Gives (N, code_size).
  Tensor operator()(Tape& tape, const Tensor& images) const;

  int image_side() const { return 4 << blocks_.size(); }
  int code_size() const { return static_cast<int>(code_.back().weight.dim(1)); }

 private:
  struct Layer {
    Tensor weight, bias;
  };
  struct Block {
    Layer first, second, skip;
    Tensor blur;
  };
  Tensor block(Tape& tape, const Block& block, const Tensor& input) const;

  Layer input_;
  std::vector<Block> blocks_;
  Layer output_;
  std::vector<Layer> coefficients_, code_;
  Tensor basis_;  // (M,D): the transposed orthonormal one
};

}  // namespace degas
