#include "model/net/blocks.h"

#include <algorithm>
#include <cmath>

#include "host/ops/conv2d.h"
#include "host/ops/linear.h"
#include "host/ops/pointwise.h"
#include "host/ops/region.h"
#include "host/ops/upsample.h"

namespace degas {

int scaled_channels(int channels, double width) {
  if (width == 1) return channels;
  return std::max(8, static_cast<int>(std::lround(channels * width / 8)) * 8);
}

ConvLayer::ConvLayer(const BlockContext& context, const std::string& name, const Shape& shape)
    : shape_(shape),
      negative_slope_(shape.activation ? context.config.negative_slope : 1),
      weights_(context.weights) {
  const int in_group = shape.in_channels / shape.groups, out_group = shape.out_channels / shape.groups;
  const double fan_in = in_group * shape.kernel * shape.kernel;
  const Tensor v = context.store.create_uniform(
      name + ".v", {shape.groups, shape.kernel, shape.kernel, in_group, out_group}, 1 / std::sqrt(fan_in));
  layer_ = weights_->add({v, context.store.create_gain(name + ".gain", name + ".v", shape.out_channels), shape.groups});
  if (shape.bias == Bias::None) return;
  const bool untied = shape.bias == Bias::Untied && context.config.untied_bias &&
                      shape.out_size <= context.config.untied_bias_max_resolution;
  bias_ = context.store.create_zeros(
      name + ".bias",
      untied ? degas::Shape{shape.out_size, shape.out_size, shape.out_channels} : degas::Shape{shape.out_channels});
}

Tensor ConvLayer::operator()(Tape& tape, const Tensor& input) const {
  return conv2d(tape, input, weights_->of(layer_), bias_,
                {shape_.stride, shape_.kernel / 2, shape_.groups, negative_slope_, shape_.keep_signs});
}

LinearLayer::LinearLayer(const BlockContext& context, const std::string& name, int inputs, int outputs, bool activation)
    : negative_slope_(activation ? context.config.negative_slope : 1), weights_(context.weights) {
  const Tensor v =
      context.store.create_uniform(name + ".v", {inputs, outputs}, 1 / std::sqrt(static_cast<double>(inputs)));
  layer_ = weights_->add({v, context.store.create_gain(name + ".gain", name + ".v", outputs)});
  bias_ = context.store.create_zeros(name + ".bias", {outputs});
}

Tensor LinearLayer::operator()(Tape& tape, const Tensor& input) const {
  return linear(tape, input, weights_->of(layer_), bias_, negative_slope_);
}

ResBlock::ResBlock(const BlockContext& context, const std::string& name, const Shape& s)
    : first_(context, name + ".first", {s.in_channels, s.in_channels, s.kernel, 1, s.groups, s.in_size}),
      second_(context, name + ".second",
              {s.in_channels, s.out_channels, s.kernel, s.stride, s.groups, s.in_size / s.stride,
               ConvLayer::Bias::Untied, true, true}),
      skip_(
          context, name + ".skip",
          {s.in_channels, s.out_channels, 1, s.stride, s.groups, s.in_size / s.stride, ConvLayer::Bias::Tied, false}) {}

Tensor ResBlock::operator()(Tape& tape, const Tensor& input) const {
  // In this order the way back frees what it can before the larger gradients.
  const Tensor main = second_(tape, first_(tape, input));
  return add(tape, main, skip_(tape, input));
}

Tensor ResBlock::of_upsampled(Tape& tape, const Tensor& input) const {
  // A 1x1 convolution and an interpolation, whose weights sum to 1, commute: the skip is taken of a quarter of the
  // pixels and enlarged where it is added.
  const Tensor skip = skip_(tape, input);
  return add_upsampled(tape, second_(tape, first_(tape, upsample(tape, input))), skip);
}

UpBlock::UpBlock(const BlockContext& context, const std::string& name, ResBlock::Shape shape, int skip_channels)
    : groups_(shape.groups),
      res_(context, name,
           {shape.in_channels + shape.groups * skip_channels, shape.out_channels, 2 * shape.in_size, shape.kernel, 1,
            shape.groups}) {}

Tensor UpBlock::operator()(Tape& tape, const Tensor& input, const Tensor& skip) const {
  if (!skip.defined()) return res_.of_upsampled(tape, input);
  const int channels = static_cast<int>(input.dim(3)) / groups_;
  std::vector<Tensor> parts;
  for (const Tensor& group :
       split_channels(tape, upsample(tape, input), std::vector<int>(static_cast<size_t>(groups_), channels))) {
    parts.push_back(group);
    parts.push_back(skip);
  }
  return res_(tape, concat_channels(tape, parts));
}

}  // namespace degas
