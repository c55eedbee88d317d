#include "host/autograd/gradient_check.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"

namespace degas {
namespace {

/// sum_i weights_i . output_i, the weights drawn once.
class WeightedSum {
 public:
  WeightedSum(Device& device, const std::vector<Tensor>& outputs, std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (const Tensor& output : outputs) {
      std::vector<double> values(output.size());
      for (double& value : values) value = uniform(random);
      weights_.push_back(Tensor::from(device, output.shape(), std::span<const double>(values)));
    }
  }
  Tensor operator()(Tape& tape, const std::vector<Tensor>& outputs) const {
    Tensor total;
    for (size_t i = 0; i < outputs.size(); ++i) {
      const Tensor term = sum(tape, multiply(tape, outputs[i], weights_[i]));
      total = total.defined() ? add(tape, total, term) : term;
    }
    return total;
  }

 private:
  std::vector<Tensor> weights_;
};

}  // namespace

double gradient_check(Device& device, const DifferentiableFunction& function, const std::vector<Tensor>& inputs,
                      const GradientCheckOptions& options) {
  std::mt19937 random(options.seed);
  Tape tape(device);
  for (Tensor input : inputs) input.clear_gradient();
  const std::vector<Tensor> outputs = function(tape, inputs);
  const WeightedSum weighted_sum(device, outputs, random);
  tape.backward(weighted_sum(tape, outputs));

  const auto evaluate = [&] {
    Tape forward_only(device, false);
    return weighted_sum(forward_only, function(forward_only, inputs)).to_host<double>()[0];
  };
  double worst = 0;
  for (Tensor input : inputs) {
    if (!input.requires_gradient()) continue;
    std::vector<double> values = input.to_host<double>();
    const std::vector<double> tape_gradient =
        input.has_gradient() ? input.gradient().to_host<double>() : std::vector<double>(values.size(), 0.0);
    std::vector<size_t> chosen(values.size());
    for (size_t i = 0; i < chosen.size(); ++i) chosen[i] = i;
    std::shuffle(chosen.begin(), chosen.end(), random);
    chosen.resize(std::min<size_t>(chosen.size(), options.samples_per_input));
    std::vector<double> numeric;
    double largest = 0;
    for (size_t i : chosen) {
      const double kept = values[i];
      values[i] = kept + options.step;
      input.upload(std::span<const double>(values));
      const double above = evaluate();
      values[i] = kept - options.step;
      input.upload(std::span<const double>(values));
      const double below = evaluate();
      values[i] = kept;
      numeric.push_back((above - below) / (2 * options.step));
      largest = std::max(largest, std::abs(numeric.back()));
    }
    input.upload(std::span<const double>(values));
    for (size_t k = 0; k < chosen.size(); ++k) {
      const double expected = numeric[k], got = tape_gradient[chosen[k]];
      const double scale = 1e-3 * largest + std::max(std::abs(expected), std::abs(got));
      // Negated so that a NaN counts as the worst of errors.
      const double error = scale == 0 ? 0 : std::abs(expected - got) / scale;
      if (!(error <= worst)) worst = std::isnan(error) ? INFINITY : error;
    }
  }
  return worst;
}

}  // namespace degas
