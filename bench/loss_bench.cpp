// L1 + SSIM, LPIPS and Adam: values alone ("forward") and with the image's gradient. LPIPS runs on invented weights, so
// that a bare machine needs no files: the time is the same.
#include <cmath>

#include "bench/support/harness.h"
#include "host/ops/lpips.h"
#include "host/ops/ssim.h"
#include "host/optim/optimiser.h"

using namespace degas;
using namespace degas::bench;

namespace {

std::vector<float> invented(int64_t count, double scale) {
  std::vector<float> values(count);
  uint32_t state = 1;
  for (float& value : values) {
    state = state * 1664525u + 1013904223u;
    value = static_cast<float>(scale * (state / 4294967296.0));
  }
  return values;
}

Tensor picture(Device& device, int height, int width, double scale) {
  const std::vector<float> values = invented(int64_t{3} * height * width, scale);
  return Tensor::from(device, {height, width, 3}, std::span<const float>(values));
}

LpipsConvolution convolution(int64_t outputs, int64_t inputs, int64_t kernel, int stride, int padding) {
  const int64_t count = outputs * inputs * kernel * kernel;
  std::vector<float> weight = invented(count, 2);
  // Around zero, so that about half of the features pass the ReLU as in a trained network.
  for (float& value : weight) value = (value - 1) / std::sqrt(static_cast<float>(inputs * kernel * kernel));
  return {{outputs, inputs, kernel, kernel}, weight, std::vector<float>(outputs, 0.01f), stride, padding};
}

LpipsLayer pool(bool ceil_mode) {
  return {LpipsLayer::Kind::Pool, {}, ceil_mode, {}};
}

std::vector<LpipsLayer> alex() {
  const auto layer = [](int64_t outputs, int64_t inputs, int64_t kernel, int stride, int padding) {
    return LpipsLayer{LpipsLayer::Kind::Convolution,
                      {convolution(outputs, inputs, kernel, stride, padding)},
                      false,
                      std::vector<float>(outputs, 1.0f)};
  };
  return {layer(64, 3, 11, 4, 2),   pool(false),
          layer(192, 64, 5, 1, 2),  pool(false),
          layer(384, 192, 3, 1, 1), layer(256, 384, 3, 1, 1),
          layer(256, 256, 3, 1, 1)};
}

std::vector<LpipsLayer> squeeze() {
  const auto fire = [](int64_t inputs, int64_t squeezed, int64_t expanded) {
    return LpipsLayer{LpipsLayer::Kind::Fire,
                      {convolution(squeezed, inputs, 1, 1, 0), convolution(expanded, squeezed, 1, 1, 0),
                       convolution(expanded, squeezed, 3, 1, 1)},
                      false,
                      std::vector<float>(2 * expanded, 1.0f)};
  };
  const LpipsLayer first{
      LpipsLayer::Kind::Convolution, {convolution(64, 3, 3, 2, 0)}, false, std::vector<float>(64, 1.0f)};
  return {first,
          pool(true),
          fire(64, 16, 64),
          fire(128, 16, 64),
          pool(true),
          fire(128, 32, 128),
          fire(256, 32, 128),
          pool(true),
          fire(256, 48, 192),
          fire(384, 48, 192),
          fire(384, 64, 256),
          fire(512, 64, 256)};
}

/// 10^9 operations of the convolutions of one image's features.
double features_gflop(const std::vector<LpipsLayer>& layers, int height, int width) {
  double operations = 0;
  for (const LpipsLayer& layer : layers) {
    const auto sides = [&](int size, int kernel, int stride, int padding) {
      return (size + 2 * padding - kernel + (layer.ceil_mode ? stride - 1 : 0)) / stride + 1;
    };
    if (layer.kind == LpipsLayer::Kind::Pool) {
      height = sides(height, 3, 2, 0);
      width = sides(width, 3, 2, 0);
    }
    for (const LpipsConvolution& c : layer.convolutions) {
      const int kernel = static_cast<int>(c.shape[2]);
      height = sides(height, kernel, c.stride, c.padding);
      width = sides(width, kernel, c.stride, c.padding);
      operations += 2.0 * static_cast<double>(element_count(c.shape)) * height * width;
    }
  }
  return 1e-9 * operations;
}

}  // namespace

int main(int count, char** values) {
  Bench bench(count, values, "losses and optimiser");
  Device& device = bench.device;
  for (const auto& [height, width] : {std::pair{480, 640}, {750, 1024}}) {
    const std::string size = " " + std::to_string(width) + "x" + std::to_string(height);
    Tensor image = picture(device, height, width, 1);
    const Tensor target = picture(device, height, width, 0.7);
    image.set_requires_gradient();
    const auto add_rows = [&](const std::string& name, Row forward, Row both,
                              const std::function<Tensor(Tape&)>& loss) {
      forward.name = name + " forward" + size;
      both.name = name + " forward + backward" + size;
      bench.run(forward, [&] {
        Tape silent(device, false);
        loss(silent);
      });
      bench.run(both, [&] {
        Tape tape(device);
        tape.backward(loss(tape));
        image.clear_gradient();
      });
    };
    // Eleven multiply-adds by row and by column for each of four blurs, and of three going back. Two numbers are read;
    // with the gradient, three derivatives are written and read, the two read again and one written.
    const auto samples = static_cast<double>(image.size());
    Row forward, both;
    forward.gflop = 4 * 44e-9 * samples;
    both.gflop = 7 * 44e-9 * samples;
    forward.gigabytes = 2 * 4e-9 * samples;
    both.gigabytes = 11 * 4e-9 * samples;
    add_rows("l1_ssim", forward, both, [&](Tape& tape) { return l1_ssim_loss(tape, image, target, 0.2); });
    for (const auto& [name, layers] : {std::pair{"alex", alex()}, {"squeeze", squeeze()}}) {
      const Lpips lpips(device, layers);
      Row features, with_gradient;  // of two images, and back to one of them
      features.gflop = 2 * features_gflop(layers, height, width);
      with_gradient.gflop = 1.5 * features.gflop;
      add_rows(std::string("lpips ") + name, features, with_gradient,
               [&](Tape& tape) { return lpips.distance(tape, image, target); });
    }
  }

  const int64_t parameters = 8 << 20;
  Optimiser adam(device);
  Tensor value = Tensor::zeros(device, {parameters});
  const std::vector<float> numbers = invented(parameters, 1e-4);
  const Tensor gradient = Tensor::from(device, {parameters}, std::span<const float>(numbers));
  adam.add("parameter", value);
  Row row;
  row.name = "adam 8 M parameters";
  row.gigabytes = 8 * 4e-9 * static_cast<double>(parameters);  // value and two moments to and fro, the gradient twice
  bench.run(row, [&] {
    value.set_gradient(gradient);
    adam.step({1e-4});
  });
  bench.finish();
}
