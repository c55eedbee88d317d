#include "host/ops/lpips.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "host/ops/conv2d.h"
#include "host/ops/pointwise.h"
#include "host/ops/pooling.h"
#include "host/ops/reduction.h"
#include "host/ops/region.h"

namespace degas {
namespace {

Tensor normalize_input(Tape& tape, const Tensor& image) {
  Device& device = tape.device();
  const int64_t pixels = image.dim(0) * image.dim(1);
  const Defines defines{{"GROUP", 1}};
  const Range range{static_cast<size_t>(pixels)};
  const Tensor output(device, {1, image.dim(0), image.dim(1), 3});
  device.kernel("lpips", "normalize_input", defines).launch(range, device.pointwise_local(), image, output, pixels);
  tape.record("lpips_input", {image}, {output}, [=](Tape& tape) {
    tape.accumulate(image, [&](const Tensor& gradient) {
      Device& device = tape.device();
      device.kernel("lpips", "normalize_input_gradient", defines)
          .launch(range, device.pointwise_local(), output.gradient(), gradient, pixels);
    });
  });
  return output;
}

/// Distance of features (1,H,W,C) at each pixel: (H,W).
Tensor feature_distance(Tape& tape, const Tensor& feature, const Tensor& target, const Tensor& weights) {
  Device& device = tape.device();
  const size_t group = device.is_wide() ? 1 : 32;
  const Defines defines{{"GROUP", static_cast<int>(group)}};
  const LocalMemory scratch{group * device.real_bytes()};
  const int channels = static_cast<int>(feature.dim(3));
  const Tensor distance(device, {feature.dim(1), feature.dim(2)});
  const Range global{static_cast<size_t>(distance.size()) * group}, local{group};
  device.kernel("lpips", "feature_distance", defines)
      .launch(global, local, feature, target, weights, distance, scratch, channels);
  tape.record("lpips_distance", {feature}, {distance}, [=](Tape& tape) {
    tape.accumulate(feature, [&](const Tensor& gradient) {
      tape.device()
          .kernel("lpips", "feature_distance_gradient", defines)
          .launch(global, local, feature, target, weights, distance.gradient(), gradient, scratch, channels);
    });
  });
  return distance;
}

}  // namespace

Lpips::Convolution Lpips::upload(Device& device, const LpipsConvolution& source) {
  const auto outputs = static_cast<int64_t>(source.bias.size());
  if (source.shape.empty() || source.shape[0] != outputs) {
    throw std::logic_error(fmt::format("[lpips] weight {} with {} biases", to_string(source.shape), outputs));
  }
  return {conv2d_weight_from_torch(device, source.shape, source.weight),
          Tensor::from(device, {outputs}, std::span<const float>(source.bias)), source.stride, source.padding};
}

Lpips::Lpips(Device& device, const std::vector<LpipsLayer>& layers) {
  for (const LpipsLayer& source : layers) {
    const size_t needed = source.kind == LpipsLayer::Kind::Fire ? 3 : source.kind == LpipsLayer::Kind::Pool ? 0 : 1;
    if (source.convolutions.size() != needed) {
      throw std::logic_error(
          fmt::format("[lpips] a layer has {} convolutions, needs {}", source.convolutions.size(), needed));
    }
    Layer layer{source.kind, {}, source.ceil_mode, {}, source.window};
    int64_t outputs = 0;
    for (const LpipsConvolution& convolution : source.convolutions) {
      layer.convolutions.push_back(upload(device, convolution));
      // A fire layer's first convolution is inside; the other two stand side by side.
      if (needed == 1 || layer.convolutions.size() > 1) outputs += layer.convolutions.back().bias.size();
    }
    if (!source.feature_weights.empty()) {
      const auto channels = static_cast<int64_t>(source.feature_weights.size());
      if (outputs != channels) {
        throw std::logic_error(fmt::format("[lpips] {} feature weights do not fit their layer", channels));
      }
      layer.feature_weights = Tensor::from(device, {channels}, std::span<const float>(source.feature_weights));
    }
    layers_.push_back(std::move(layer));
  }
  while (output_side(smallest_side_) < 1) ++smallest_side_;
}

int Lpips::output_side(int side) const {
  for (const Layer& layer : layers_) {
    if (layer.kind == LpipsLayer::Kind::Pool) {
      if (side < layer.window) return 0;
      side = (side - layer.window + (layer.ceil_mode ? 1 : 0)) / 2 + 1;
    }
    for (const Convolution& convolution : layer.convolutions) {
      const int kernel = static_cast<int>(convolution.weight.dim(1)), room = side + 2 * convolution.padding - kernel;
      if (room < 0) return 0;
      side = room / convolution.stride + 1;
    }
  }
  return side;
}

Tensor Lpips::convolve(Tape& tape, const Tensor& input, const Convolution& convolution) {
  return conv2d(tape, input, convolution.weight, convolution.bias,
                {.stride = convolution.stride, .padding = convolution.padding, .groups = 1, .negative_slope = 0});
}

void Lpips::run(Tape& tape, const Tensor& image,
                const std::function<void(const Layer&, const Tensor&)>& compare) const {
  Tensor current = normalize_input(tape, image);
  for (const Layer& layer : layers_) {
    if (layer.kind == LpipsLayer::Kind::Pool) current = max_pool(tape, current, layer.ceil_mode, layer.window);
    if (layer.kind == LpipsLayer::Kind::Convolution) current = convolve(tape, current, layer.convolutions[0]);
    if (layer.kind == LpipsLayer::Kind::Fire) {
      const Tensor squeezed = convolve(tape, current, layer.convolutions[0]);
      current = concat_channels(
          tape, {convolve(tape, squeezed, layer.convolutions[1]), convolve(tape, squeezed, layer.convolutions[2])});
    }
    if (layer.feature_weights.defined()) compare(layer, current);
  }
}

Tensor Lpips::distance(Tape& tape, const Tensor& image, const Tensor& target) const {
  if (image.shape() != target.shape() || image.shape().size() != 3 || image.dim(2) != 3 ||
      std::min(image.dim(0), image.dim(1)) < smallest_side_) {
    throw std::logic_error(fmt::format("[lpips] needs two (H,W,3) images of one size, sides at least {}, got {} and {}",
                                       smallest_side_, to_string(image.shape()), to_string(target.shape())));
  }
  Tape silent(tape.device(), false);
  std::vector<Tensor> wanted;
  run(silent, target, [&](const Layer&, const Tensor& feature) { wanted.push_back(feature); });
  Tensor total;
  size_t compared = 0;
  // Compared as they come, so that the way back has the gradient of one layer at a time.
  run(tape, image, [&](const Layer& layer, const Tensor& feature) {
    const Tensor term = mean(tape, feature_distance(tape, feature, wanted[compared++], layer.feature_weights));
    total = total.defined() ? add(tape, total, term) : term;
  });
  return total;
}

}  // namespace degas
