#include "model/net/expression_encoder.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "host/ops/conv2d.h"
#include "host/ops/linear.h"
#include "host/ops/pointwise.h"

namespace degas {
namespace {

constexpr double negative_slope = 0.2;
// sqrt(2) leaky_relu(x + b) = leaky_relu(sqrt(2) x + sqrt(2) b), so gains go into weights and biases.
constexpr double activation_gain = std::numbers::sqrt2;
constexpr double merge_gain = 1 / std::numbers::sqrt2;  // of a block's two paths
// A blur has one weight a channel, but the convolution's kernels work on whole vectors of channels.
constexpr int64_t blur_group = 16;

void require(bool fits, const char* what, const EncoderLayer& layer) {
  const int64_t outputs = layer.shape.empty() ? 0 : layer.shape[0];
  if (fits && element_count(layer.shape) == static_cast<int64_t>(layer.weight.size()) &&
      (layer.bias.empty() || static_cast<int64_t>(layer.bias.size()) == outputs))
    return;
  throw std::logic_error(fmt::format("[expression_encoder] {} of shape {} with {} biases does not fit", what,
                                     to_string(layer.shape), layer.bias.size()));
}

Tensor scaled_bias(Device& device, const EncoderLayer& layer, double gain) {
  if (layer.bias.empty()) return {};
  std::vector<double> bias(layer.bias.begin(), layer.bias.end());
  for (double& value : bias) value *= gain;
  return Tensor::from(device, {layer.shape[0]}, std::span<const double>(bias));
}

/// A square convolution of `inputs` channels with its equalised scale times `gain`.
auto convolution(Device& device, const EncoderLayer& layer, int64_t inputs, int64_t kernel, double gain) {
  require(layer.shape.size() == 4 && layer.shape[1] == inputs && layer.shape[2] == kernel && layer.shape[3] == kernel,
          "a convolution", layer);
  const double scale = gain / std::sqrt(static_cast<double>(inputs * kernel * kernel));
  return std::pair(conv2d_weight_from_torch(device, layer.shape, layer.weight, scale),
                   scaled_bias(device, layer, gain));
}

/// (Out,In) as (In,Out), with the equalised scale.
auto fully_connected(Device& device, const EncoderLayer& layer, int64_t inputs) {
  require(layer.shape.size() == 2 && layer.shape[1] == inputs, "a linear layer", layer);
  const double scale = 1 / std::sqrt(static_cast<double>(inputs));
  const int64_t outputs = layer.shape[0];
  std::vector<double> weight(layer.weight.size());
  for (int64_t output = 0; output < outputs; ++output) {
    for (int64_t input = 0; input < inputs; ++input) {
      weight[input * outputs + output] = scale * static_cast<double>(layer.weight[output * inputs + input]);
    }
  }
  return std::pair(Tensor::from(device, {inputs, outputs}, std::span<const double>(weight)),
                   scaled_bias(device, layer, 1));
}

/// Q^T of the basis' QR decomposition by Householder reflections, signs as LAPACK's.
Tensor orthonormal_rows(Device& device, const EncoderLayer& basis, int64_t inputs, int64_t outputs) {
  require(basis.shape == Shape{outputs, inputs} && outputs >= inputs, "the basis", basis);
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Matrix values = Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
                            basis.weight.data(), outputs, inputs)
                            .cast<double>();
  const Eigen::HouseholderQR<Matrix> factors(values);
  const Matrix rows = (factors.householderQ() * Matrix::Identity(outputs, inputs)).transpose();
  return Tensor::from(device, {inputs, outputs},
                      std::span<const double>(rows.data(), static_cast<size_t>(rows.size())));
}

Tensor blur_weight(Device& device, int64_t channels) {
  const int64_t group = channels % blur_group == 0 ? blur_group : 1;
  constexpr double taps[] = {1, 3, 3, 1};
  std::vector<double> weight;
  for (int64_t g = 0; g < channels / group; ++g) {
    for (int tap = 0; tap < 16; ++tap) {
      for (int64_t i = 0; i < group * group; ++i) {
        weight.push_back(i % (group + 1) == 0 ? taps[tap / 4] * taps[tap % 4] / 64 : 0);  // on the diagonal
      }
    }
  }
  return Tensor::from(device, {channels / group, 4, 4, group, group}, std::span<const double>(weight));
}

}  // namespace

ExpressionEncoder::ExpressionEncoder(Device& device, const ExpressionEncoderWeights& weights) {
  const auto layer = [](std::pair<Tensor, Tensor> parts) { return Layer{parts.first, parts.second}; };
  if (weights.blocks.empty() || weights.coefficients.empty() || weights.code.empty()) {
    throw std::logic_error("[expression_encoder] needs a block and a layer of each kind");
  }
  input_ = layer(convolution(device, weights.input, 3, 1, activation_gain));
  int64_t channels = weights.input.shape[0];
  for (const ExpressionEncoderWeights::Block& source : weights.blocks) {
    blocks_.push_back({layer(convolution(device, source.first, channels, 3, activation_gain)),
                       layer(convolution(device, source.second, channels, 3, activation_gain * merge_gain)),
                       layer(convolution(device, source.skip, channels, 1, merge_gain)),
                       blur_weight(device, channels)});
    channels = source.second.shape[0];
    require(source.skip.shape[0] == channels, "a skip", source.skip);
  }
  output_ = layer(convolution(device, weights.output, channels, 4, 1));
  const int64_t features = weights.output.shape[0];
  int64_t width = features;
  for (const EncoderLayer& source : weights.coefficients) {
    coefficients_.push_back(layer(fully_connected(device, source, width)));
    width = source.shape[0];
  }
  basis_ = orthonormal_rows(device, weights.basis, width, features);
  width = features;
  for (const EncoderLayer& source : weights.code) {
    code_.push_back(layer(fully_connected(device, source, width)));
    width = source.shape[0];
  }
}

Tensor ExpressionEncoder::block(Tape& tape, const Block& block, const Tensor& input) const {
  const int groups = static_cast<int>(block.blur.dim(0));
  const Tensor first = conv2d(tape, input, block.first.weight, block.first.bias, {1, 1, 1, negative_slope});
  const Tensor blurred = conv2d(tape, first, block.blur, {}, {1, 2, groups});  // a pixel more than the input on a side
  const Tensor second = conv2d(tape, blurred, block.second.weight, block.second.bias, {2, 0, 1, negative_slope});
  // The stride of a 1x1 convolution may as well be the blur's.
  const Tensor thinned = conv2d(tape, input, block.blur, {}, {2, 1, groups});
  return add(tape, second, conv2d(tape, thinned, block.skip.weight, block.skip.bias, {}));
}

Tensor ExpressionEncoder::operator()(Tape& tape, const Tensor& images) const {
  const int64_t side = image_side();
  if (images.shape().size() != 4 || images.shape() != Shape{images.dim(0), side, side, 3}) {
    throw std::logic_error(
        fmt::format("[expression_encoder] needs images (N,{0},{0},3), got {1}", side, to_string(images.shape())));
  }
  Tensor map = conv2d(tape, images, input_.weight, input_.bias, {1, 0, 1, negative_slope});
  for (const Block& next : blocks_) map = block(tape, next, map);
  const Tensor features = conv2d(tape, map, output_.weight, output_.bias, {});
  Tensor row = features.reshaped({images.dim(0), features.dim(3)});
  for (const Layer& next : coefficients_) row = linear(tape, row, next.weight, next.bias);
  row = linear(tape, row, basis_, {});
  for (const Layer& next : code_) row = linear(tape, row, next.weight, next.bias);
  return row;
}

}  // namespace degas
