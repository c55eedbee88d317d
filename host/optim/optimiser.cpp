#include "host/optim/optimiser.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <tuple>

#include "host/ops/batch.h"

namespace degas {
namespace {

constexpr int64_t parameter_block = 4096;
constexpr std::array<int32_t, 5> no_steps = {0, 0, 0, -1, -1};  // the kernels' counters
constexpr double unknown_norm = -1e30;                          // the kernels' UNKNOWN

/// The kernels' Batch.
struct ParameterBatch {
  int64_t counts[batch_size];
  int32_t parameters[batch_size], ends[batch_size];
};

Kernel optimiser_kernel(Device& device, const char* name) {
  return device.kernel("optimiser", name, {{"BLOCK", parameter_block}, {"GROUP", group_size(device)}});
}

int64_t slots_of(const Tensor& value) {
  return (value.size() + parameter_block - 1) / parameter_block;
}

}  // namespace

Optimiser::Optimiser(Device& device, const OptimiserOptions& options) : device_(device), options_(options) {}

void Optimiser::add(const std::string& name, const Tensor& value, int group, UpdateRule rule) {
  const auto place =
      std::lower_bound(parameters_.begin(), parameters_.end(), name,
                       [](const Parameter& parameter, const std::string& key) { return parameter.name < key; });
  if (place != parameters_.end() && place->name == name) {
    throw std::logic_error(fmt::format("[optimiser] two parameters are named '{}'", name));
  }
  if (started_) throw std::logic_error(fmt::format("[optimiser] parameter '{}' added after the first step", name));
  parameters_.insert(
      place, {name, group, rule, value, Tensor::zeros(device_, value.shape()), Tensor::zeros(device_, value.shape())});
  allocate();
}

// With each parameter rather than in the first step: there it would take buffers that the second step then misses.
void Optimiser::allocate() {
  const auto count = static_cast<int64_t>(parameters_.size());
  int64_t slots = 1;
  for (const Parameter& parameter : parameters_) slots += slots_of(parameter.value);
  partial_ = Tensor(device_, {slots});
  owners_ = Tensor(device_, {slots}, Element::Int32);
  present_ = Tensor::zeros(device_, {count}, Element::Int32);
  applied_ = Tensor::zeros(device_, {count}, Element::Int32);
  bias_ = Tensor::zeros(device_, {count, 2});
  state_ = Tensor::from(device_, {5}, std::span<const double>(std::array{0.0, 1.0, unknown_norm, 0.0, 0.0}));
  counters_ = Tensor::from(device_, {5}, std::span<const int32_t>(no_steps));
}

/// `arrays` gives a parameter's tensors; the batch is the kernel's last argument.
template <typename Arrays, typename... Arguments>
void Optimiser::launch_batch(const Kernel& kernel, const Batch& batch, const Arrays& arrays,
                             const Arguments&... arguments) const {
  ParameterBatch argument{};
  for (size_t k = 0, end = 0; k < batch_size; ++k) {
    if (k < batch.members.size()) {
      const Parameter& parameter = parameters_[batch.members[k]];
      argument.counts[k] = parameter.value.size();
      argument.parameters[k] = static_cast<int32_t>(batch.members[k]);
      end += slots_of(parameter.value);
    }
    argument.ends[k] = static_cast<int32_t>(end);
  }
  const size_t group = group_size(device_);
  degas::launch_batch(
      kernel, {static_cast<size_t>(batch.blocks) * group}, {group}, batch.members,
      [&](size_t member) { return arrays(parameters_[member]); }, arguments..., argument);
}

std::vector<Optimiser::Batch> Optimiser::make_batches() const {
  std::vector<Batch> batches;
  for (size_t i = 0; i < parameters_.size(); ++i) {
    const Parameter& parameter = parameters_[i];
    if (!parameter.value.has_gradient()) continue;
    if (batches.empty() || batches.back().members.size() == batch_size || batches.back().group != parameter.group ||
        batches.back().rule != parameter.rule) {
      batches.push_back({parameter.group, parameter.rule, 0, {}});
    }
    batches.back().members.push_back(i);
    batches.back().blocks += static_cast<int>(slots_of(parameter.value));
  }
  return batches;
}

void Optimiser::step(const std::vector<double>& learning_rates) {
  if (parameters_.empty()) return;
  started_ = true;
  for (const Parameter& parameter : parameters_) {
    if (parameter.group < 0 || parameter.group >= static_cast<int>(learning_rates.size())) {
      throw std::logic_error(
          fmt::format("[optimiser] no learning rate for group {} of '{}'", parameter.group, parameter.name));
    }
  }
  const size_t group = group_size(device_);
  const LocalMemory scratch{group * device_.real_bytes()};
  const std::vector<Batch> batches = make_batches();
  const Kernel square_sums = optimiser_kernel(device_, "square_sums"), adam = optimiser_kernel(device_, "adam"),
               rprop = optimiser_kernel(device_, "rprop");
  int slots = 0;
  for (const Batch& batch : batches) {
    launch_batch(
        square_sums, batch, [](const Parameter& p) { return std::tuple(p.value.gradient()); }, partial_, owners_,
        present_, scratch, slots);
    slots += batch.blocks;
  }
  optimiser_kernel(device_, "decide")
      .launch({group}, {group}, partial_, owners_, present_, applied_, bias_, state_, counters_, scratch, slots,
              static_cast<int>(parameters_.size()), options_.clip_above, options_.clip_to, options_.spike_limit,
              std::log(options_.beta1), std::log(options_.beta2));
  const auto arrays = [](const Parameter& p) {
    return std::tuple(p.value, p.value.gradient(), p.first_moment, p.second_moment);
  };
  for (const Batch& batch : batches) {
    const double rate = learning_rates[batch.group];
    if (batch.rule == UpdateRule::Adam) {
      launch_batch(adam, batch, arrays, bias_, state_, rate, options_.beta1, options_.beta2, options_.epsilon);
    } else {
      launch_batch(rprop, batch, arrays, state_, rate, options_.growth, options_.shrinkage, options_.smallest_step,
                   options_.largest_step);
    }
  }
  clear_gradients();
}

void Optimiser::clear_gradients() {
  for (Parameter& parameter : parameters_) parameter.value.clear_gradient();
}

Optimiser::Counters Optimiser::counters() const {
  if (parameters_.empty()) return {};
  const std::vector<int32_t> counts = counters_.to_host<int32_t>();
  const std::vector<double> state = state_.to_host<double>();
  Counters counters{counts[0], counts[1], counts[2], state[0], {}};
  if (counts[4] >= 0) {
    counters.last_skipped = {counts[3], parameters_[static_cast<size_t>(counts[4])].name, state[3], std::exp(state[4])};
  }
  return counters;
}

Optimiser::Progress Optimiser::progress() const {
  if (parameters_.empty()) return {};
  return {counters(), applied_.to_host<int32_t>(), state_.to_host<double>()[2]};
}

void Optimiser::restore(const Progress& progress) {
  if (progress.applied.size() != parameters_.size()) {
    throw std::logic_error(fmt::format("[optimiser] progress of {} parameters restored to {}", progress.applied.size(),
                                       parameters_.size()));
  }
  if (parameters_.empty()) return;
  started_ = true;
  std::array<int32_t, 5> counts = no_steps;
  counts[0] = progress.counters.applied;
  counts[1] = progress.counters.skipped;
  counts[2] = progress.counters.skipped_in_a_row;
  const std::vector<double> state{progress.counters.last_norm, 1, progress.log_largest_norm.value_or(unknown_norm), 0,
                                  0};
  counters_.upload(std::span<const int32_t>(counts));
  state_.upload(std::span<const double>(state));
  applied_.upload(std::span<const int32_t>(progress.applied));
}

}  // namespace degas
