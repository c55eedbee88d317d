#include "host/ops/weight_norm.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "host/ops/batch.h"

namespace degas {
namespace {

/// The kernels' Batch.
struct BatchArgument {
  int32_t rows[batch_size], columns[batch_size], block_rows[batch_size], ends[batch_size], sums[batch_size],
      tensors[batch_size];
};

/// Layers that a launch takes together, by their places in the list.
struct Batch {
  std::vector<size_t> members;
  BatchArgument argument{};
  int blocks = 0;
  int64_t sums = 0;  ///< numbers of all column sums
};

/// Rows of a block: some thousand elements, but few enough blocks that adding up what they leave is no work.
int block_rows(const Device& device, int rows, int columns) {
  const int elements = device.is_wide() ? 8192 : 2048;
  return std::min(rows, std::max({1, elements / columns, rows / 64}));
}

std::vector<Batch> make_batches(const Device& device, const std::vector<WeightNormLayer>& layers,
                                const std::vector<size_t>& members) {
  std::vector<Batch> batches;
  for (size_t begin = 0; begin < members.size(); begin += batch_size) {
    Batch& batch = batches.emplace_back();
    batch.members.assign(members.begin() + begin, members.begin() + std::min(begin + batch_size, members.size()));
    BatchArgument& a = batch.argument;
    for (size_t k = 0; k < batch_size; ++k) {
      if (k < batch.members.size()) {
        const WeightNormLayer& layer = layers[batch.members[k]];
        a.columns[k] = static_cast<int>(layer.v.dim(-1));
        a.rows[k] = static_cast<int>(layer.v.size() / (int64_t{layer.groups} * a.columns[k]));
        a.block_rows[k] = block_rows(device, a.rows[k], a.columns[k]);
        a.sums[k] = static_cast<int>(batch.sums);
        a.tensors[k] = static_cast<int>(batch.members[k]);
        const int blocks = layer.groups * ((a.rows[k] + a.block_rows[k] - 1) / a.block_rows[k]);
        batch.blocks += blocks;
        batch.sums += int64_t{blocks} * a.columns[k];
      }
      a.ends[k] = batch.blocks;
    }
  }
  return batches;
}

/// A work-group for each of `groups`; arrays(layer's place) gives a tuple of its tensors.
template <typename Arrays, typename... Arguments>
void launch_weight_norm(Device& device, const char* name, const Batch& batch, size_t groups, const Arrays& arrays,
                        const Arguments&... arguments) {
  const size_t group = group_size(device);
  launch_batch(device.kernel("weight_norm", name, {{"GROUP", group_size(device)}}), {groups * group}, {group},
               batch.members, arrays, arguments..., batch.argument);
}

void require_fitting(const WeightNormLayer& layer) {
  const int64_t columns = layer.v.dim(-1);
  if (layer.groups < 1 || layer.gain.size() != layer.groups * columns ||
      layer.v.size() % (layer.groups * columns) != 0) {
    throw std::logic_error(fmt::format("[weight_norm] gain {} and {} groups do not fit v {}",
                                       to_string(layer.gain.shape()), layer.groups, to_string(layer.v.shape())));
  }
}

}  // namespace

std::vector<Tensor> weight_norm(Tape& tape, const std::vector<WeightNormLayer>& layers) {
  Device& device = tape.device();
  std::vector<Tensor> weights, inputs, outputs;
  std::vector<size_t> all;
  for (const WeightNormLayer& layer : layers) {
    require_fitting(layer);
    all.push_back(weights.size());
    weights.emplace_back(device, layer.v.shape());
    inputs.insert(inputs.end(), {layer.v, layer.gain});
    outputs.push_back(weights.back().without_values());
  }
  const LocalMemory scratch{group_size(device) * device.real_bytes()};
  const Tensor numbers(device, {static_cast<int64_t>(layers.size()), 2});
  for (const Batch& batch : make_batches(device, layers, all)) {
    const Tensor partial(device, {batch.blocks});
    launch_weight_norm(
        device, "square_sums", batch, batch.blocks, [&](size_t i) { return std::tuple(layers[i].v); }, partial,
        scratch);
    launch_weight_norm(
        device, "weight_norm", batch, batch.blocks,
        [&](size_t i) { return std::tuple(layers[i].v, layers[i].gain, weights[i]); }, partial, numbers, scratch);
  }
  tape.record("weight_norm", inputs, outputs, [=](Tape& tape) {
    Device& device = tape.device();
    std::vector<Tensor> dv(layers.size()), dgain(layers.size());
    std::vector<size_t> reached;
    for (size_t i = 0; i < layers.size(); ++i) {
      if (!outputs[i].has_gradient()) continue;
      reached.push_back(i);
      dv[i] = Tensor(device, layers[i].v.shape());
      dgain[i] = Tensor(device, layers[i].gain.shape());
    }
    for (const Batch& batch : make_batches(device, layers, reached)) {
      const Tensor partial(device, {batch.sums});
      launch_weight_norm(
          device, "output_sums", batch, batch.blocks,
          [&](size_t i) { return std::tuple(layers[i].v, outputs[i].gradient()); }, partial);
      launch_weight_norm(
          device, "finish_output_sums", batch, batch.members.size(),
          [&](size_t i) { return std::tuple(layers[i].gain, dgain[i]); }, partial, numbers, scratch);
      launch_weight_norm(
          device, "weight_norm_backward", batch, batch.blocks,
          [&](size_t i) { return std::tuple(layers[i].v, layers[i].gain, outputs[i].gradient(), dv[i]); }, numbers);
    }
    for (const size_t i : reached) {
      tape.accumulate(layers[i].gain, dgain[i]);
      tape.accumulate(layers[i].v, dv[i]);
    }
  });
  return weights;
}

}  // namespace degas
