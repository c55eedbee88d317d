#include "model/net/map_network.h"

#include <cmath>
#include <set>

#include "tests/support/catch.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

constexpr int side = 128, baseline_joints = 5;

NetConfig baseline_config(NetKind kind, bool isotropic) {
  NetConfig config;
  config.kind = kind;
  config.isotropic = isotropic;
  config.resolution = side;
  config.width = 0.125;
  config.color_degree = 1;
  config.decoder_channels = {8, 8, 8};
  return config;
}

std::unique_ptr<MapNetwork> small_network(Device& device, NetKind kind, bool isotropic = false) {
  return make_network(device, baseline_config(kind, isotropic), 0,
                      random_tensor(device, {side / 8, side / 8, baseline_joints}, 1, 1, 2), 1, {});
}

MapNetwork::Inputs random_baseline_inputs(Device& device, unsigned seed) {
  return {
      random_tensor(device, {1, side, side, 3}, seed), random_tensor(device, {3 * baseline_joints}, seed + 1), {}, {}};
}

std::vector<Tensor> maps_of(Tape& tape, const MapNetwork& network, const MapNetwork::Inputs& inputs) {
  const HeadMaps maps = network.decode(tape, inputs, 3);
  return {maps.position_offsets, maps.rotation_scale, maps.color_opacity, maps.color_harmonics};
}

std::vector<double> values_of(const std::vector<Tensor>& tensors) {
  std::vector<double> values;
  for (const Tensor& tensor : tensors) {
    const std::vector<double> part = tensor.to_host<double>();
    values.insert(values.end(), part.begin(), part.end());
  }
  return values;
}

std::vector<double> decoded(const MapNetwork& network, const MapNetwork::Inputs& inputs) {
  Tape tape(network.parameters().device(), false);
  return values_of(maps_of(tape, network, inputs));
}

/// Gains away from the norms and biases from zero, so that no gradient is zero by chance.
void disturb(MapNetwork& network) {
  unsigned seed = 100;
  for (const ParameterStore::Parameter& parameter : network.parameters().parameters()) {
    std::vector<double> values = parameter.value.to_host<double>();
    const std::vector<double> noise = random_values(static_cast<int64_t>(values.size()), ++seed, -0.2, 0.2);
    for (size_t i = 0; i < values.size(); ++i) values[i] += noise[i];
    Tensor(parameter.value).upload(std::span<const double>(values));
  }
}

}  // namespace

TEST_CASE("each kind of network reads its own signals alone, and makes maps of all heads") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const NetKind kind = GENERATE(NetKind::Degas, NetKind::Static, NetKind::Skips, NetKind::Mlp);
  const auto network = small_network(device, kind);
  disturb(*network);
  const MapNetwork::Inputs inputs = random_baseline_inputs(device, 10), others = random_baseline_inputs(device, 20);
  Tape tape(device, false);
  const std::vector<Tensor> maps = maps_of(tape, *network, inputs);
  const int64_t channels[] = {3, 7, 4, 9};
  for (size_t i = 0; i < maps.size(); ++i) CHECK(maps[i].shape() == Shape{1, side, side, channels[i]});
  const auto changes = [&](Tensor MapNetwork::Inputs::*input) {
    MapNetwork::Inputs changed = inputs;
    changed.*input = others.*input;
    return decoded(*network, changed) != decoded(*network, inputs);
  };
  CHECK(changes(&MapNetwork::Inputs::posed_vertex_map) == (kind == NetKind::Degas || kind == NetKind::Skips));
  CHECK(changes(&MapNetwork::Inputs::pose) == (kind == NetKind::Degas || kind == NetKind::Mlp));
  if (kind == NetKind::Static) CHECK_NOTHROW(network->decode(tape, {}));
  if (kind != NetKind::Static) CHECK_THROWS_AS(network->decode(tape, {}), std::logic_error);
  CHECK(network->config().use_pvm == (kind == NetKind::Degas));
}

TEST_CASE("isotropic heads: one scale, the base's rotation, one opacity") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const auto network =
      small_network(device, GENERATE(NetKind::Degas, NetKind::Static, NetKind::Skips, NetKind::Mlp), true);
  disturb(*network);
  Tape tape(device, false);
  const HeadMaps maps = network->decode(tape, random_baseline_inputs(device, 10));
  REQUIRE(maps.rotation_scale.dim(3) == 7);
  REQUIRE(maps.color_opacity.dim(3) == 4);
  const std::vector<double> shape = maps.rotation_scale.to_host<double>(), color = maps.color_opacity.to_host<double>();
  for (size_t texel = 0; texel < side * side; ++texel) {
    for (size_t c = 0; c < 4; ++c) REQUIRE(shape[7 * texel + c] == 0);
    REQUIRE(shape[7 * texel + 4] != 0);
    REQUIRE(shape[7 * texel + 5] == shape[7 * texel + 4]);
    REQUIRE(shape[7 * texel + 6] == shape[7 * texel + 4]);
    REQUIRE(1 / (1 + std::exp(-color[4 * texel + 3])) == Approx(isotropic_opacity));
  }
  CHECK(std::set<double>(color.begin(), color.end()).size() > 1000);
}

TEST_CASE("gradients of every parameter of every kind pass finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const NetKind kind = GENERATE(NetKind::Static, NetKind::Skips, NetKind::Mlp);
  const bool isotropic = kind == NetKind::Static;
  const auto network = small_network(device, kind, isotropic);
  disturb(*network);
  const MapNetwork::Inputs inputs = random_baseline_inputs(device, 10);
  for (const auto& parameter : network->parameters().parameters()) Tensor(parameter.value).set_requires_gradient();
  Tape tape(device);
  std::vector<Tensor> maps = maps_of(tape, *network, inputs), seeds;
  for (const Tensor& map : maps) seeds.push_back(random_tensor(device, map.shape(), 5));
  const std::vector<double> weights = values_of(seeds);
  tape.backward(maps, std::move(seeds));

  REQUIRE(network->parameters().parameters().size() >= 4);
  for (const ParameterStore::Parameter& parameter : network->parameters().parameters()) {
    CAPTURE(parameter.name);
    // Along one random direction through all of a tensor, whose derivative stands far above the maps' rounding.
    const std::vector<double> values = parameter.value.to_host<double>(),
                              gradient = parameter.value.gradient().to_host<double>(),
                              direction = random_values(static_cast<int64_t>(values.size()), 7, -1, 1);
    double expected = 0, squares = 0;
    for (size_t i = 0; i < values.size(); ++i) {
      expected += gradient[i] * direction[i];
      squares += gradient[i] * gradient[i] * direction[i] * direction[i];
    }
    const auto error_of = [&](double step) {
      const auto maps_at = [&](double distance) {
        std::vector<double> moved = values;
        for (size_t i = 0; i < moved.size(); ++i) moved[i] += distance * direction[i];
        Tensor(parameter.value).upload(std::span<const double>(moved));
        return decoded(*network, inputs);
      };
      const std::vector<double> ahead = maps_at(step), behind = maps_at(-step);
      Tensor(parameter.value).upload(std::span<const double>(values));
      double numeric = 0;
      for (size_t i = 0; i < weights.size(); ++i) numeric += weights[i] * (ahead[i] - behind[i]) / (2 * step);
      return std::abs(numeric - expected) / std::sqrt(squares);  // not to the sum itself, which may cancel
    };
    REQUIRE(squares > 0);
    // Leaky ReLUs that turn within the step are worth up to 1.4e-3 at 1e-6, and the less the smaller it is; rounding,
    // in tensors with little gradient, up to 1.5e-4 at 1e-8, and the less the larger it is. A wrong gradient fits
    // neither.
    double error = INFINITY;
    for (const double step : {3e-8, 3e-7}) {
      if (error > 1e-4) error = std::min(error, error_of(step));
    }
    CHECK(error < 1e-4);
  }
}

TEST_CASE("a step of every kind repeats to the bit and allocates nothing after the first") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const auto network = small_network(device, GENERATE(NetKind::Static, NetKind::Skips, NetKind::Mlp), true);
  for (const auto& parameter : network->parameters().parameters()) Tensor(parameter.value).set_requires_gradient();
  const MapNetwork::Inputs inputs = random_baseline_inputs(device, 10);
  const auto gradients = [&] {
    Tape tape(device);
    std::vector<Tensor> maps = maps_of(tape, *network, inputs), seeds;
    for (const Tensor& map : maps) seeds.push_back(random_tensor(device, map.shape(), 5));
    tape.backward(maps, std::move(seeds));
    std::vector<Tensor> all;
    for (const auto& parameter : network->parameters().parameters()) {
      CAPTURE(parameter.name);
      REQUIRE(parameter.value.has_gradient());
      all.push_back(parameter.value.gradient());
    }
    const std::vector<double> values = values_of(all);
    for (const auto& parameter : network->parameters().parameters()) Tensor(parameter.value).clear_gradient();
    return values;
  };
  const std::vector<double> first = gradients();
  const size_t allocations = device.memory_statistics().device_allocations;
  const bool same = gradients() == first;
  CHECK(same);
  CHECK(device.memory_statistics().device_allocations == allocations);
}
