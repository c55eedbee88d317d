#include "host/ops/weight_norm.h"

#include <cmath>

#include "host/autograd/gradient_check.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

/// (groups, kernel, kernel, inputs of a group, outputs of a group)
struct WeightNormCase {
  int groups, kernel, inputs, outputs;
  Shape shape() const { return {groups, kernel, kernel, inputs, outputs}; }
};

}  // namespace

TEST_CASE("weight_norm equals the plain loop") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const WeightNormCase c = GENERATE(
      WeightNormCase{1, 3, 5, 3}, WeightNormCase{3, 3, 7, 17}, WeightNormCase{2, 1, 16, 16}, WeightNormCase{1, 1, 1, 1},
      WeightNormCase{1, 1, 300, 129}, WeightNormCase{1, 1, 300, 257}, WeightNormCase{3, 3, 90, 33});
  const Tensor v = random_tensor(device, c.shape(), 1), gain = random_tensor(device, {c.groups * c.outputs}, 2);
  const std::vector<double> values = v.to_host<double>(), g = gain.to_host<double>();
  double square = 0;
  for (const double value : values) square += value * value;
  std::vector<double> expected(values.size());
  const size_t rows = c.kernel * c.kernel * c.inputs;
  for (size_t i = 0; i < expected.size(); ++i) {
    const size_t group = i / (rows * c.outputs);
    expected[i] = g[group * c.outputs + i % c.outputs] * values[i] / std::sqrt(square);
  }
  Tape tape(device, false);
  CHECK(largest_difference(weight_norm(tape, {{v, gain, c.groups}})[0].to_host<double>(), expected) < 1e-6);
}

TEST_CASE("weight_norm's norm keeps its precision over two million elements", "[large]") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Tensor v = random_tensor(device, {2048, 1024}, 1), gain = random_tensor(device, {1024}, 2, 1, 1.0001);
  const std::vector<double> values = v.to_host<double>(), g = gain.to_host<double>();
  double square = 0;
  for (const double value : values) square += value * value;
  Tape tape(device, false);
  const std::vector<double> w = weight_norm(tape, {{v, gain}})[0].to_host<double>();
  for (size_t i = 0; i < w.size(); i += 1031) {
    CHECK(w[i] == Approx(g[i % 1024] * values[i] / std::sqrt(square)).epsilon(2e-6));
  }
}

TEST_CASE("weight_norm of zeros is zeros, with a finite gradient") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Tensor v = Tensor::zeros(device, {4, 3}).set_requires_gradient();
  const Tensor gain = random_tensor(device, {3}, 2).set_requires_gradient();
  Tape tape(device);
  const Tensor w = weight_norm(tape, {{v, gain}})[0];
  CHECK(w.to_host<double>() == std::vector<double>(12, 0.0));
  tape.backward(mean(tape, w));
  CHECK(v.gradient().to_host<double>() == std::vector<double>(12, 0.0));
  CHECK(gain.gradient().to_host<double>() == std::vector<double>(3, 0.0));
}

TEST_CASE("weight_norm's gradient passes finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const WeightNormCase c =
      GENERATE(WeightNormCase{1, 3, 5, 3}, WeightNormCase{3, 3, 5, 17}, WeightNormCase{2, 1, 16, 16},
               WeightNormCase{1, 1, 70, 33}, WeightNormCase{1, 1, 130, 257}, WeightNormCase{3, 3, 40, 33});
  const Tensor v = random_tensor(device, c.shape(), 1).set_requires_gradient();
  const Tensor gain = random_tensor(device, {c.groups * c.outputs}, 2).set_requires_gradient();
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    return weight_norm(tape, {{in[0], in[1], c.groups}});
  };
  // In units of the norm, which is about the root of the size: smaller steps drown in the rounding of large sums.
  const double step = 1e-5 * std::sqrt(static_cast<double>(v.size()));
  CHECK(gradient_check(device, function, {v, gain}, {.step = step}) < 1e-6);
}

TEST_CASE("layers made together have the weights and gradients that each has alone") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  std::vector<WeightNormLayer> layers;
  for (int i = 0; i < 21; ++i) {  // more than a launch takes
    const int groups = 1 + i % 3, kernel = 1 + 2 * (i % 2), inputs = 1 + 3 * i, outputs = 3 + 5 * (i % 7);
    const auto seed = static_cast<unsigned>(2 * i);
    layers.push_back({random_tensor(device, {groups, kernel, kernel, inputs, outputs}, seed).set_requires_gradient(),
                      random_tensor(device, {groups * outputs}, seed + 1).set_requires_gradient(), groups});
  }
  const auto is_reached = [](size_t layer) { return layer != 4 && layer != 17; };
  // The squares of the weights, so that each element has another gradient.
  const auto back = [&](const std::vector<Tensor>& weights, const std::vector<size_t>& of, Tape& tape) {
    Tensor total;
    for (size_t i = 0; i < weights.size(); ++i) {
      if (!is_reached(of[i])) continue;
      const Tensor term = sum(tape, multiply(tape, weights[i], weights[i]));
      total = total.defined() ? add(tape, total, term) : term;
    }
    if (total.defined()) tape.backward(total);
  };
  std::vector<std::vector<float>> weights, gradients;
  for (size_t i = 0; i < layers.size(); ++i) {
    Tape tape(device);
    const std::vector<Tensor> weight = weight_norm(tape, {layers[i]});
    weights.push_back(weight[0].to_host<float>());
    back(weight, {i}, tape);
    for (Tensor parameter : {layers[i].v, layers[i].gain}) {
      gradients.push_back(is_reached(i) ? parameter.gradient().to_host<float>() : std::vector<float>());
      parameter.clear_gradient();
    }
  }
  Tape tape(device);
  const std::vector<Tensor> together = weight_norm(tape, layers);
  std::vector<size_t> all;
  for (size_t i = 0; i < layers.size(); ++i) all.push_back(i);
  back(together, all, tape);
  for (size_t i = 0; i < layers.size(); ++i) {
    CAPTURE(i);
    CHECK(together[i].to_host<float>() == weights[i]);
    CHECK(layers[i].v.has_gradient() == is_reached(i));
    if (!is_reached(i)) continue;
    CHECK(layers[i].v.gradient().to_host<float>() == gradients[2 * i]);
    CHECK(layers[i].gain.gradient().to_host<float>() == gradients[2 * i + 1]);
  }
}
