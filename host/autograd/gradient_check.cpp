#include "host/autograd/gradient_check.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

namespace degas {
namespace {

using Values = std::vector<std::vector<double>>;

Values random_like(const std::vector<Tensor>& tensors, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  Values drawn;
  for (const Tensor& tensor : tensors) {
    for (double& value : drawn.emplace_back(tensor.size())) value = uniform(random);
  }
  return drawn;
}

Values to_host(const std::vector<Tensor>& tensors) {
  Values values;
  for (const Tensor& tensor : tensors) values.push_back(tensor.to_host<double>());
  return values;
}

/// sum_i weights_i . (a_i - b_i): element by element, so that what a and b have in common takes no digits away.
double weighted_difference(const Values& weights, const Values& a, const Values& b) {
  double total = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    for (size_t k = 0; k < weights[i].size(); ++k) total += weights[i][k] * (a[i][k] - b[i][k]);
  }
  return total;
}

size_t samples_of(const GradientCheckOptions& options) {
  const char* limit = std::getenv("DEGAS_GRADIENT_SAMPLES");
  return std::min(options.samples_per_input, limit ? std::max(1, std::atoi(limit)) : options.samples_per_input);
}

}  // namespace

double gradient_check(Device& device, const DifferentiableFunction& function, const std::vector<Tensor>& inputs,
                      const GradientCheckOptions& options) {
  std::mt19937 random(options.seed);
  Tape tape(device);
  for (Tensor input : inputs) input.clear_gradient();
  const std::vector<Tensor> outputs = function(tape, inputs);
  // The gradient of a weighted sum of the outputs begins with its weights.
  const Values weights = random_like(outputs, random);
  std::vector<Tensor> gradients;
  for (size_t i = 0; i < outputs.size(); ++i) {
    gradients.push_back(Tensor::from(device, outputs[i].shape(), std::span<const double>(weights[i])));
  }
  tape.backward(outputs, std::move(gradients));

  const auto evaluate = [&] {
    Tape forward_only(device, false);
    return to_host(function(forward_only, inputs));
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
    chosen.resize(std::min(chosen.size(), samples_of(options)));
    std::vector<double> numeric;
    double largest = 0;
    for (size_t i : chosen) {
      const double kept = values[i];
      values[i] = kept + options.step;
      input.upload(std::span<const double>(values));
      const Values above = evaluate();
      values[i] = kept - options.step;
      input.upload(std::span<const double>(values));
      const Values below = evaluate();
      values[i] = kept;
      numeric.push_back(weighted_difference(weights, above, below) / (2 * options.step));
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
