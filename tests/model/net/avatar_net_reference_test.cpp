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

// As in tests/vectors/make_avatar_net.py.
constexpr int resolution = 128, code_size = 20, joints = 54, stride = 97;
constexpr uint64_t seed = 3, test_seed = 7;

NetConfig small_config() {
  NetConfig config;
  config.resolution = resolution;
  config.width = 0.25;
  config.noise_std = 0;
  config.kl_weight = 1;
  return config;
}

Tensor drawn(Device& device, const std::string& name, const Shape& shape, double bound = 1) {
  ParameterStore store(device, test_seed);
  return store.create_uniform(name, shape, bound).set_requires_gradient(false);
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

/// Biases away from zero and gains away from the norms, so that a mistake in either shows.
void disturb(AvatarNet& net) {
  for (const ParameterStore::Parameter& parameter : net.parameters().parameters()) {
    const bool gain = ends_with(parameter.name, ".gain");
    if (!gain && !ends_with(parameter.name, ".bias")) continue;
    std::vector<double> values = parameter.value.to_host<double>();
    const std::vector<double> noise =
        drawn(parameter.value.device(), parameter.name, parameter.value.shape(), gain ? 1 : 0.1).to_host<double>();
    for (size_t i = 0; i < values.size(); ++i) values[i] = gain ? values[i] * (1 + 0.1 * noise[i]) : noise[i];
    Tensor(parameter.value).upload(std::span<const double>(values));
  }
}

/// Largest difference of every stride-th element from the stored ones, relative to the stored ones' largest.
double difference(const std::vector<double>& values, const std::vector<double>& stored) {
  double largest = 0, scale = 1e-30;
  for (const double value : stored) scale = std::max(scale, std::abs(value));
  for (size_t i = 0; i < stored.size(); ++i) {
    if (i * stride >= values.size()) return INFINITY;
    const double error = std::abs(values[i * stride] - stored[i]);
    if (!(error <= largest)) largest = std::isnan(error) ? INFINITY : error;
  }
  return largest / scale;
}

}  // namespace

TEST_CASE("the network equals PyTorch's, layer by layer and gradient by gradient") {
  const KernelSet set = GENERATE(from_range(kernel_sets()));
  const Real real = GENERATE(Real::Double, Real::Float);
  if (set == KernelSet::Gpu && real == Real::Float)
    return;  // adds build time, and nothing to the double run's evidence
  const double bar = real == Real::Double ? 1e-9 : 3e-4;
  Device& device = test::device(set, real);
  const NpzFile file(std::string(DEGAS_TEST_VECTORS) + "/avatar_net.npz");

  const int side = resolution / 8;
  std::vector<double> masks = drawn(device, "joint_masks", {side, side, joints}).to_host<double>();
  for (double& mask : masks) mask = mask > 0;
  AvatarNet net(device, small_config(), code_size,
                Tensor::from(device, {side, side, joints}, std::span<const double>(masks)), seed);
  CHECK(static_cast<double>(net.parameters().count()) == file.read("parameter_count").doubles()[0]);
  disturb(net);
  const AvatarNet::Inputs inputs{drawn(device, "posed_vertex_map", {1, resolution, resolution, 3}),
                                 drawn(device, "pose", {3 * joints}),
                                 drawn(device, "face_code", {code_size}),
                                 {}};

  Tape tape(device);
  std::vector<Tensor> levels;
  const AvatarNet::Encoding encoding = net.encode(tape, inputs, 1);
  const HeadMaps maps = net.decode_feature(tape, encoding.joint_feature, &levels);
  const auto check = [&](const char* name, const Tensor& tensor) {
    INFO(name);
    CHECK(difference(tensor.to_host<double>(), file.read(name).doubles()) < bar);
  };
  check("divergence", encoding.divergence);
  check("joint_feature", encoding.joint_feature);
  check("level_0", levels.at(0));
  check("level_1", levels.at(1));
  check("level_2", levels.at(2));
  check("position", maps.position_offsets);
  check("rotation_scale", maps.rotation_scale);
  check("color_opacity", maps.color_opacity);

  Tensor loss = encoding.divergence;
  const std::pair<const char*, Tensor> heads[] = {{"position", maps.position_offsets},
                                                  {"rotation_scale", maps.rotation_scale},
                                                  {"color_opacity", maps.color_opacity}};
  for (const auto& [name, map] : heads) {
    loss = add(tape, loss, sum(tape, multiply(tape, map, drawn(device, name, map.shape()))));
  }
  tape.backward(loss);
  for (const ParameterStore::Parameter& parameter : net.parameters().parameters()) {
    INFO("gradient of " << parameter.name);
    REQUIRE(parameter.value.has_gradient());
    const std::vector<double> stored = file.read("gradient " + parameter.name).doubles();
    // Single precision: the sums over a map of 128 x 128 in another order.
    CHECK(difference(parameter.value.gradient().to_host<double>(), stored) < (real == Real::Double ? 1e-8 : 2e-2));
  }
}
