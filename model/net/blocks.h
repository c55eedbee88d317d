#pragma once

#include <memory>
#include <string>

#include "host/autograd/tape.h"
#include "model/config.h"
#include "model/net/layer_weights.h"
#include "model/net/parameter_store.h"

namespace degas {

/// Channels or code size after the width multiplier: the nearest multiple of 8, at least 8; unchanged at width 1.
int scaled_channels(int channels, double width);

/// What layers share.
struct BlockContext {
  ParameterStore& store;
  const NetConfig& config;
  std::shared_ptr<LayerWeights> weights;  ///< a LayerWeights::Pass must be on while the layers run
};

/// A weight-normalised convolution with a bias (untied up to net.untied_bias_max_resolution, tied above; or none at
/// all), and a leaky ReLU where asked. Padding keeps the side (or halves it with stride 2).
class ConvLayer {
 public:
  enum class Bias { None, Tied, Untied };
  struct Shape {
    int in_channels, out_channels;
    int kernel = 3, stride = 1, groups = 1;
    int out_size = 0;  ///< side of the output, for untied biases
    Bias bias = Bias::Untied;
    bool activation = true;
    bool keep_signs = false;  ///< as Conv2dOptions
  };
  ConvLayer(const BlockContext& context, const std::string& name, const Shape& shape);
  Tensor operator()(Tape& tape, const Tensor& input) const;

 private:
  Shape shape_;
  double negative_slope_;
  std::shared_ptr<LayerWeights> weights_;
  size_t layer_;  ///< its number in weights_
  Tensor bias_;
};

/// A weight-normalised fully connected layer with bias.
class LinearLayer {
 public:
  LinearLayer(const BlockContext& context, const std::string& name, int inputs, int outputs, bool activation);
  Tensor operator()(Tape& tape, const Tensor& input) const;

 private:
  double negative_slope_;
  std::shared_ptr<LayerWeights> weights_;
  size_t layer_;
  Tensor bias_;
};

/// Res(Cin -> Cout) of method.md: conv Cin -> Cin and conv Cin -> Cout, each with bias and leaky ReLU, plus a 1x1 skip;
/// the second convolution and the skip carry the stride. `Conv` is Res at stride 1, `Down` at stride 2.
class ResBlock {
 public:
  struct Shape {
    int in_channels, out_channels;
    int in_size;  ///< side of the input
    int kernel = 3, stride = 1, groups = 1;
  };
  ResBlock(const BlockContext& context, const std::string& name, const Shape& shape);
  Tensor operator()(Tape& tape, const Tensor& input) const;
  /// The same of upsample(input), at stride 1.
  Tensor of_upsampled(Tape& tape, const Tensor& input) const;

 private:
  ConvLayer first_, second_, skip_;
};

/// Up of method.md: bilinear x2, then Res at twice the input's side.
class UpBlock {
 public:
  /// shape.in_size: side before enlarging. skip_channels: of a map that stands beside the enlarged one, in each group.
  UpBlock(const BlockContext& context, const std::string& name, ResBlock::Shape shape, int skip_channels = 0);
  /// skip: (N, 2H, 2W, skip_channels), where there is one.
  Tensor operator()(Tape& tape, const Tensor& input, const Tensor& skip = {}) const;

 private:
  int groups_;
  ResBlock res_;
};

}  // namespace degas
