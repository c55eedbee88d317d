#include "host/optim/adam.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace degas {
namespace {

constexpr int64_t block = 4096;

int group_size(const Device& device) {
  return device.is_wide() ? 1 : 256;
}

Kernel adam_kernel(Device& device, const char* name) {
  return device.kernel("adam", name, {{"BLOCK", block}, {"GROUP", group_size(device)}});
}

int64_t slots_of(const Tensor& value) {
  return (value.size() + block - 1) / block;
}

}  // namespace

Adam::Adam(Device& device, const AdamOptions& options) : device_(device), options_(options) {}

void Adam::add(const std::string& name, const Tensor& value, int group) {
  const auto place =
      std::lower_bound(parameters_.begin(), parameters_.end(), name,
                       [](const Parameter& parameter, const std::string& key) { return parameter.name < key; });
  if (place != parameters_.end() && place->name == name) {
    throw std::logic_error(fmt::format("[adam] two parameters are named '{}'", name));
  }
  if (started_) throw std::logic_error(fmt::format("[adam] parameter '{}' added after the first step", name));
  parameters_.insert(
      place, {name, group, value, Tensor::zeros(device_, value.shape()), Tensor::zeros(device_, value.shape())});
  allocate();
}

// With each parameter rather than in the first step: there it would take buffers that the second step then misses.
void Adam::allocate() {
  const auto count = static_cast<int64_t>(parameters_.size());
  int64_t slots = 1;
  for (const Parameter& parameter : parameters_) slots += slots_of(parameter.value);
  partial_ = Tensor(device_, {slots});
  present_ = Tensor::zeros(device_, {count}, Element::Int32);
  applied_ = Tensor::zeros(device_, {count}, Element::Int32);
  bias_ = Tensor::zeros(device_, {count, 2});
  state_ = Tensor::zeros(device_, {2});
  counters_ = Tensor::zeros(device_, {3}, Element::Int32);
}

void Adam::step(const std::vector<double>& learning_rates) {
  if (parameters_.empty()) return;
  started_ = true;
  const size_t group = group_size(device_);
  const LocalMemory scratch{group * device_.real_bytes()};
  int slots = 0;
  for (size_t i = 0; i < parameters_.size(); ++i) {
    const Parameter& parameter = parameters_[i];
    if (parameter.group < 0 || parameter.group >= static_cast<int>(learning_rates.size())) {
      throw std::logic_error(
          fmt::format("[adam] no learning rate for group {} of '{}'", parameter.group, parameter.name));
    }
    if (!parameter.value.has_gradient()) continue;
    const size_t blocks = slots_of(parameter.value);
    adam_kernel(device_, "square_sums")
        .launch({blocks * group}, {group}, parameter.value.gradient(), partial_, present_, scratch, slots,
                static_cast<int>(i), parameter.value.size());
    slots += static_cast<int>(blocks);
  }
  adam_kernel(device_, "decide")
      .launch({group}, {group}, partial_, present_, applied_, bias_, state_, counters_, scratch, slots,
              static_cast<int>(parameters_.size()), options_.clip_above, options_.clip_to, std::log(options_.beta1),
              std::log(options_.beta2));
  const Kernel update = adam_kernel(device_, "update");
  for (size_t i = 0; i < parameters_.size(); ++i) {
    const Parameter& parameter = parameters_[i];
    if (!parameter.value.has_gradient()) continue;
    update.launch(device_.pointwise_global(parameter.value.size()), device_.pointwise_local(), parameter.value,
                  parameter.value.gradient(), parameter.first_moment, parameter.second_moment, bias_, state_,
                  static_cast<int>(i), learning_rates[parameter.group], options_.beta1, options_.beta2,
                  options_.epsilon, parameter.value.size());
  }
  clear_gradients();
}

void Adam::clear_gradients() {
  for (Parameter& parameter : parameters_) parameter.value.clear_gradient();
}

Adam::Counters Adam::counters() const {
  if (parameters_.empty()) return {};
  const std::vector<int32_t> counts = counters_.to_host<int32_t>();
  return {counts[0], counts[1], counts[2], state_.to_host<double>()[0]};
}

Adam::Progress Adam::progress() const {
  if (parameters_.empty()) return {};
  return {counters(), applied_.to_host<int32_t>()};
}

void Adam::restore(const Progress& progress) {
  if (progress.applied.size() != parameters_.size()) {
    throw std::logic_error(
        fmt::format("[adam] progress of {} parameters restored to {}", progress.applied.size(), parameters_.size()));
  }
  if (parameters_.empty()) return;
  started_ = true;
  const std::vector<int32_t> counts{progress.counters.applied, progress.counters.skipped,
                                    progress.counters.skipped_in_a_row};
  const std::vector<double> state{progress.counters.last_norm, 1};
  counters_.upload(std::span<const int32_t>(counts));
  state_.upload(std::span<const double>(state));
  applied_.upload(std::span<const int32_t>(progress.applied));
}

}  // namespace degas
