#include <cmath>

#include "host/io/npz.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "model/net/avatar_net.h"
#include "tests/support/catch.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

// As in tests/vectors/network_layers.py and the scripts that use it.
constexpr int reference_resolution = 128, reference_code_size = 20, reference_joints = 54, reference_stride = 97;
constexpr uint64_t seed = 3, test_seed = 7;

NetConfig reference_config() {
  NetConfig config;
  config.resolution = reference_resolution;
  config.width = 0.25;
  config.noise_std = 0;
  config.kl_weight = 1;
  return config;
}

Tensor drawn_uniform(Device& device, const std::string& name, const Shape& shape, double bound = 1) {
  ParameterStore store(device, test_seed);
  return store.create_uniform(name, shape, bound).set_requires_gradient(false);
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

/// Biases away from zero and gains away from the norms, so that a mistake in either shows.
void disturb_biases_and_gains(MapNetwork& net) {
  for (const ParameterStore::Parameter& parameter : net.parameters().parameters()) {
    const bool gain = ends_with(parameter.name, ".gain");
    if (!gain && !ends_with(parameter.name, ".bias")) continue;
    std::vector<double> values = parameter.value.to_host<double>();
    const std::vector<double> noise =
        drawn_uniform(parameter.value.device(), parameter.name, parameter.value.shape(), gain ? 1 : 0.1)
            .to_host<double>();
    for (size_t i = 0; i < values.size(); ++i) values[i] = gain ? values[i] * (1 + 0.1 * noise[i]) : noise[i];
    Tensor(parameter.value).upload(std::span<const double>(values));
  }
}

/// Largest difference of every reference_stride-th element from the stored ones, relative to the stored ones'
/// largest.
double strided_difference(const std::vector<double>& values, const std::vector<double>& stored) {
  double largest = 0, scale = 1e-30;
  for (const double value : stored) scale = std::max(scale, std::abs(value));
  for (size_t i = 0; i < stored.size(); ++i) {
    if (i * reference_stride >= values.size()) return INFINITY;
    const double error = std::abs(values[i * reference_stride] - stored[i]);
    if (!(error <= largest)) largest = std::isnan(error) ? INFINITY : error;
  }
  return largest / scale;
}

Tensor posed_vertex_map(Device& device) {
  return drawn_uniform(device, "posed_vertex_map", {1, reference_resolution, reference_resolution, 3});
}

Tensor pose(Device& device) {
  return drawn_uniform(device, "pose", {3 * reference_joints});
}

/// PyTorch's numbers, and how far the device's may be from them.
struct Reference {
  NpzFile file;
  Real real;

  Reference(const std::string& name, Real real) : file(std::string(DEGAS_TEST_VECTORS) + "/" + name), real(real) {}

  void check(const char* name, const Tensor& tensor) const {
    INFO(name);
    CHECK(strided_difference(tensor.to_host<double>(), file.read(name).doubles()) <
          (real == Real::Double ? 1e-9 : 3e-4));
  }

  /// The heads' maps, and every parameter's gradient of the stored loss: `loss`, where defined, and products of the
  /// heads with drawn numbers.
  void check_heads_and_gradients(Tape& tape, const MapNetwork& net, const HeadMaps& maps, Tensor loss = {}) const {
    CHECK(static_cast<double>(net.parameters().count()) == file.read("parameter_count").doubles()[0]);
    const std::pair<const char*, Tensor> heads[] = {{"position", maps.position_offsets},
                                                    {"rotation_scale", maps.rotation_scale},
                                                    {"color_opacity", maps.color_opacity}};
    for (const auto& [name, map] : heads) {
      check(name, map);
      const Tensor product = sum(tape, multiply(tape, map, drawn_uniform(tape.device(), name, map.shape())));
      loss = loss.defined() ? add(tape, loss, product) : product;
    }
    tape.backward(loss);
    for (const ParameterStore::Parameter& parameter : net.parameters().parameters()) {
      INFO("gradient of " << parameter.name);
      REQUIRE(parameter.value.has_gradient());
      const std::vector<double> stored = file.read("gradient " + parameter.name).doubles();
      // Single precision: the sums over a map of 128 x 128 in another order.
      CHECK(strided_difference(parameter.value.gradient().to_host<double>(), stored) <
            (real == Real::Double ? 1e-8 : 2e-2));
    }
  }
};

}  // namespace

TEST_CASE("the network equals PyTorch's, layer by layer and gradient by gradient") {
  const KernelSet set = GENERATE(from_range(kernel_sets()));
  const Real real = GENERATE(Real::Double, Real::Float);
  if (set == KernelSet::Gpu && real == Real::Float)
    return;  // adds build time, and nothing to the double run's evidence
  Device& device = test::device(set, real);
  const Reference reference("avatar_net.npz", real);

  const int side = reference_resolution / 8;
  std::vector<double> masks = drawn_uniform(device, "joint_masks", {side, side, reference_joints}).to_host<double>();
  for (double& mask : masks) mask = mask > 0;
  AvatarNet net(device, reference_config(), reference_code_size,
                Tensor::from(device, {side, side, reference_joints}, std::span<const double>(masks)), seed);
  disturb_biases_and_gains(net);
  const AvatarNet::Inputs inputs{
      posed_vertex_map(device), pose(device), drawn_uniform(device, "face_code", {reference_code_size}), {}};

  Tape tape(device);
  std::vector<Tensor> levels;
  const AvatarNet::Encoding encoding = net.encode(tape, inputs, 1);
  const HeadMaps maps = net.decode_feature(tape, encoding.joint_feature, &levels);
  reference.check("divergence", encoding.divergence);
  reference.check("joint_feature", encoding.joint_feature);
  reference.check("level_0", levels.at(0));
  reference.check("level_1", levels.at(1));
  reference.check("level_2", levels.at(2));
  reference.check_heads_and_gradients(tape, net, maps, encoding.divergence);
}

TEST_CASE("the baselines' networks equal PyTorch's, gradient by gradient") {
  const KernelSet set = GENERATE(from_range(kernel_sets()));
  const NetKind kind = GENERATE(NetKind::Skips, NetKind::Mlp);
  Device& device = test::device(set, Real::Double);
  const Reference reference(kind == NetKind::Skips ? "skip_net.npz" : "texel_mlp.npz", Real::Double);
  NetConfig config = reference_config();
  config.kind = kind;
  const auto net = make_network(
      device, config, 0, Tensor::zeros(device, {reference_resolution / 8, reference_resolution / 8, reference_joints}),
      seed, {});
  disturb_biases_and_gains(*net);
  Tape tape(device);
  reference.check_heads_and_gradients(tape, *net, net->decode(tape, {posed_vertex_map(device), pose(device), {}, {}}));
}
