#include "model/net/avatar_net.h"

#include <set>

#include "host/error.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/catch.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

constexpr int code_size = 12, joints = 54;

NetConfig small_config() {
  NetConfig config;
  config.resolution = 128;
  config.width = 0.125;
  config.decoder_channels = {8, 8, 8};
  return config;
}

Tensor all_masks(Device& device, int resolution) {
  const int side = resolution / 8;
  return random_tensor(device, {side, side, joints}, 1, 1, 2);
}

AvatarNet make_net(Device& device, const NetConfig& config, uint64_t seed = 1, int face_code_size = code_size) {
  return AvatarNet(device, config, face_code_size, all_masks(device, config.resolution), seed);
}

AvatarNet::Inputs random_inputs(Device& device, unsigned seed) {
  return {random_tensor(device, {1, 128, 128, 3}, seed), random_tensor(device, {3 * joints}, seed + 1),
          random_tensor(device, {code_size}, seed + 2), random_tensor(device, {1, 128, 128, 3}, seed + 3)};
}

std::vector<double> feature(AvatarNet& net, const AvatarNet::Inputs& inputs, std::optional<uint64_t> noise_seed = {}) {
  Tape tape(net.parameters().device(), false);
  return net.encode(tape, inputs, noise_seed).joint_feature.to_host<double>();
}

std::vector<double> all_maps(AvatarNet& net, const AvatarNet::Inputs& inputs) {
  Tape tape(net.parameters().device(), false);
  const HeadMaps maps = net.decode(tape, inputs);
  std::vector<double> values;
  for (const Tensor& map : {maps.position_offsets, maps.rotation_scale, maps.color_opacity}) {
    const std::vector<double> part = map.to_host<double>();
    values.insert(values.end(), part.begin(), part.end());
  }
  return values;
}

}  // namespace

TEST_CASE("the paper's model has the paper's layers and about 88 million parameters") {
  Device& device = test::device(KernelSet::Wide);
  const NetConfig config;
  const AvatarNet net(device, config, 512, all_masks(device, config.resolution), 1);
  const ParameterStore& store = net.parameters();
  const std::pair<const char*, Shape> expected[] = {
      {"pvm.0.first.v", {1, 3, 3, 3, 3}},
      {"pvm.0.first.bias", {512, 512, 3}},
      {"pvm.2.second.v", {1, 3, 3, 16, 32}},
      {"pvm.2.second.bias", {64, 64, 32}},
      {"pve.6.second.v", {1, 3, 3, 128, 128}},
      {"pve.6.second.bias", {4, 4, 128}},
      {"pve.mean.v", {2048, 1024}},
      {"pve.log_deviation.v", {2048, 1024}},
      {"pve_decoder.linear.v", {1024, 2048}},
      {"pve_decoder.0.first.bias", {8, 8, 128}},
      {"pve_decoder.3.second.v", {1, 3, 3, 64, 32}},
      {"pve_decoder.3.second.bias", {64, 64, 32}},
      {"pose.first.v", {1, 1, 1, 162, 162}},
      {"pose.second.bias", {64, 64, 16}},
      {"face.linear.v", {512, 512}},
      {"face.0.second.v", {1, 3, 3, 32, 64}},
      {"face.2.second.bias", {32, 32, 32}},
      {"joint.second.v", {1, 3, 3, 80, 128}},
      {"joint.second.bias", {64, 64, 128}},
      {"joint.skip.bias", {128}},
      {"decoder.0.first.v", {3, 3, 3, 128, 128}},
      {"decoder.0.first.bias", {128, 128, 384}},
      {"decoder.1.second.v", {3, 3, 3, 64, 32}},
      {"decoder.2.second.v", {3, 3, 3, 32, 16}},
      {"decoder.2.second.bias", {512, 512, 48}},
      {"head.position.bias", {512, 512, 3}},
      {"head.rotation_scale.v", {1, 3, 3, 16, 7}},
      {"head.color_opacity.v", {1, 3, 3, 16, 4}},
  };
  for (const auto& [name, shape] : expected) {
    INFO(name);
    CHECK(store.find(name).shape() == shape);
  }
  CHECK_FALSE(store.contains("pvm.3.first.v"));
  CHECK_FALSE(store.contains("face.3.first.v"));
  CHECK_FALSE(store.contains("decoder.3.first.v"));
  int64_t biases = 0;
  for (const auto& parameter : store.parameters()) {
    if (parameter.name.ends_with(".bias")) biases += parameter.value.size();
  }
  CHECK(store.count() - biases == 9232188);  // 9.2 million weights and gains
  CHECK(biases == 77354928);
}

TEST_CASE("harmonics of the colour have a head of their own and leave everything else as it is") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  NetConfig config = small_config();
  AvatarNet plain = make_net(device, config);
  config.color_degree = 2;
  AvatarNet net = make_net(device, config);
  const AvatarNet::Inputs inputs = random_inputs(device, 7);
  CHECK(all_maps(net, inputs) == all_maps(plain, inputs));
  Tape tape(device);
  const HeadMaps maps = net.decode(tape, inputs);
  CHECK(maps.color_harmonics.shape() == Shape{1, 128, 128, 24});
  CHECK_FALSE(plain.decode(tape, inputs).color_harmonics.defined());
  const Tensor bias = net.parameters().find("decoder.2.second.bias");
  Tensor(bias).set_requires_gradient();
  tape.backward(mean(tape, net.decode(tape, inputs).color_harmonics));
  const std::vector<double> gradient = bias.gradient().to_host<double>();
  const size_t channels = bias.dim(-1);
  std::array<double, 3> of_group{};  // position, rotation and scale, colour
  for (size_t i = 0; i < gradient.size(); ++i) of_group[i % channels * 3 / channels] += std::abs(gradient[i]);
  CHECK(of_group[0] == 0);
  CHECK(of_group[1] == 0);
  CHECK(of_group[2] > 0);
}

TEST_CASE("switches remove their part and leave the others' initial values") {
  Device& device = test::device(KernelSet::Wide);
  AvatarNet full = make_net(device, small_config());
  const AvatarNet::Inputs inputs = random_inputs(device, 10), others = random_inputs(device, 20);
  struct Switch {
    const char* prefix;
    Tensor AvatarNet::Inputs::*input;
    AvatarNet net;
  };
  NetConfig without_pose = small_config();
  without_pose.use_pose_embedding = false;
  Switch switches[] = {{"pose.", &AvatarNet::Inputs::pose, make_net(device, without_pose)},
                       {"face.", &AvatarNet::Inputs::face_code, make_net(device, small_config(), 1, 0)}};
  for (Switch& off : switches) {
    INFO(off.prefix);
    for (const auto& parameter : off.net.parameters().parameters()) {
      CHECK(parameter.name.rfind(off.prefix, 0) != 0);
      if (parameter.name == "pvm.0.first.v") {
        CHECK(parameter.value.to_host<double>() == full.parameters().find("pvm.0.first.v").to_host<double>());
      }
    }
    AvatarNet::Inputs changed = inputs;
    changed.*off.input = others.*off.input;
    CHECK(feature(full, inputs) != feature(full, changed));
    CHECK(feature(off.net, inputs) == feature(off.net, changed));
    changed.*off.input = Tensor();
    CHECK(feature(off.net, inputs) == feature(off.net, changed));
  }
  // Either encoder of the posed vertex map sees it; without both nobody does.
  AvatarNet::Inputs changed = inputs;
  changed.posed_vertex_map = others.posed_vertex_map;
  for (const auto& [pvm, pve] : {std::pair(true, false), std::pair(false, true), std::pair(false, false)}) {
    NetConfig config = small_config();
    config.use_pvm = pvm;
    config.use_pve = pve;
    AvatarNet net = make_net(device, config);
    CHECK((feature(net, inputs) != feature(net, changed)) == (pvm || pve));
  }
}

TEST_CASE("world normals reach the face, where the face map hides the posed vertex map") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const AvatarNet::Inputs inputs = random_inputs(device, 10), others = random_inputs(device, 20);
  NetConfig config = small_config();
  AvatarNet without = make_net(device, config);
  config.use_world_normals = true;
  AvatarNet with = make_net(device, config);
  CHECK(with.parameters().find("pvm.0.first.v").to_host<double>() ==
        without.parameters().find("pvm.0.first.v").to_host<double>());
  AvatarNet::Inputs other_normals = inputs, other_vertices = inputs;
  other_normals.world_normals = others.world_normals;
  other_vertices.posed_vertex_map = others.posed_vertex_map;
  CHECK(feature(without, inputs) == feature(without, other_normals));
  // The middle of the top-left quarter of the joint feature: three texels from every other quarter.
  const int side = config.resolution / 8;
  const auto face = [&](const AvatarNet::Inputs& seen) {
    const std::vector<double> all = feature(with, seen);
    const size_t channels = all.size() / (side * side), texel = (side / 4) * side + side / 4;
    return std::vector<double>(all.begin() + texel * channels, all.begin() + (texel + 1) * channels);
  };
  CHECK(face(inputs) == face(other_vertices));
  CHECK(face(inputs) != face(other_normals));
}

TEST_CASE("the face map lies where the head does in the atlas") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const NetConfig config = small_config();
  const FaceRegion region = GENERATE(FaceRegion{}, FaceRegion{8, 8}, FaceRegion{3, 5});
  AvatarNet net(device, config, code_size, all_masks(device, config.resolution), 1, region);
  AvatarNet::Inputs inputs = random_inputs(device, 10), other_face = inputs;
  other_face.face_code = random_inputs(device, 20).face_code;
  const std::vector<double> one = feature(net, inputs), two = feature(net, other_face);
  const int side = config.resolution / 8, channels = static_cast<int>(one.size()) / (side * side);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const int row = y - region.row, column = x - region.column;  // the feature's side is the region's grid
      const auto begin = (y * side + x) * channels;
      const bool same = std::equal(one.begin() + begin, one.begin() + begin + channels, two.begin() + begin);
      CAPTURE(x, y);
      // Two 3x3 convolutions follow: what is three texels away is untouched.
      if (row >= 0 && row < side / 2 && column >= 0 && column < side / 2) REQUIRE(!same);
      if (row < -2 || row > side / 2 + 1 || column < -2 || column > side / 2 + 1) REQUIRE(same);
    }
  }
}

TEST_CASE("without any map a trained constant carries the face") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  NetConfig config = small_config();
  config.use_world_normals = true;  // beside the constant, which carries the face map
  config.use_pose_embedding = config.use_pvm = config.use_pve = false;
  AvatarNet net = make_net(device, config);
  CHECK(feature(net, random_inputs(device, 10)) != feature(net, random_inputs(device, 20)));
  Tape tape(device);
  tape.backward(mean(tape, net.decode(tape, random_inputs(device, 10)).color_opacity));
  for (const double value : net.parameters().find("constant").gradient().to_host<double>())
    REQUIRE(std::isfinite(value));
}

TEST_CASE("pose channel c sees the mask of joint c div 3") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  NetConfig config = small_config();
  config.use_pvm = config.use_pve = false;
  config.joint_masks = GENERATE(JointMasks::Joint, JointMasks::Modulo, JointMasks::None);
  // Joint 20 alone moves the texel (3, 5).
  const int side = config.resolution / 8, joint = 20;
  std::vector<float> masks(side * side * joints, 0.0F);
  masks[(3 * side + 5) * joints + joint] = 0.25F;
  AvatarNet net(device, config, 0, Tensor::from(device, {side, side, joints}, std::span<const float>(masks)), 1);
  const std::vector<float> rest(3 * joints, 0.0F);
  const auto feature_of = [&](const std::vector<float>& pose) {
    return feature(net, {{}, Tensor::from(device, {3 * joints}, std::span<const float>(pose)), {}, {}});
  };
  const std::vector<double> still = feature_of(rest);
  std::set<int> seen;
  for (const int channel : {0, 19, 20, 21, 59, 60, 61, 62, 63, 74, 128, 161}) {
    std::vector<float> pose = rest;
    pose[channel] = 1;
    if (feature_of(pose) != still) seen.insert(channel);
  }
  if (config.joint_masks == JointMasks::Joint) CHECK(seen == std::set<int>{60, 61, 62});
  if (config.joint_masks == JointMasks::Modulo) CHECK(seen == std::set<int>{20, 74, 128});
  if (config.joint_masks == JointMasks::None) CHECK(seen.size() == 12);
}

TEST_CASE("the latent's noise follows the seed and stays out of evaluation") {
  Device& device = test::device(KernelSet::Wide);
  NetConfig config = small_config();
  const AvatarNet::Inputs inputs = random_inputs(device, 10);
  AvatarNet quiet = make_net(device, config);
  config.noise_std = 1;
  AvatarNet noisy = make_net(device, config);
  CHECK(feature(quiet, inputs, 5) == feature(quiet, inputs));
  CHECK(feature(noisy, inputs) == feature(quiet, inputs));
  CHECK(feature(noisy, inputs, 5) == feature(noisy, inputs, 5));
  CHECK(feature(noisy, inputs, 5) != feature(noisy, inputs, 6));
  CHECK(feature(noisy, inputs, 5) != feature(noisy, inputs));
}

TEST_CASE("biases are tied above the largest untied side, or everywhere") {
  Device& device = test::device(KernelSet::Wide);
  NetConfig config = small_config();
  config.untied_bias_max_resolution = 32;
  const AvatarNet partly = make_net(device, config);
  CHECK(partly.parameters().find("decoder.0.first.bias").shape() == Shape{32, 32, 48});
  CHECK(partly.parameters().find("decoder.1.first.bias").shape() == Shape{24});
  config.untied_bias = false;
  AvatarNet tied = make_net(device, config);
  CHECK(tied.parameters().find("decoder.0.first.bias").shape() == Shape{48});
  CHECK(all_maps(tied, random_inputs(device, 10)).size() == size_t{128 * 128 * 14});
}

TEST_CASE("a step repeats to the bit, and allocates nothing after the first") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  NetConfig config = small_config();
  config.noise_std = 1;
  config.kl_weight = 0.1;
  AvatarNet net = make_net(device, config);
  const AvatarNet::Inputs inputs = random_inputs(device, 10);
  const auto gradients = [&] {
    Tape tape(device);
    const HeadMaps maps = net.decode(tape, inputs, 5);
    Tensor loss = add(tape, maps.divergence, mean(tape, maps.position_offsets));
    loss = add(tape, loss, add(tape, mean(tape, maps.rotation_scale), mean(tape, maps.color_opacity)));
    tape.backward(loss);
    std::vector<double> values;
    for (const auto& parameter : net.parameters().parameters()) {
      INFO(parameter.name);
      REQUIRE(parameter.value.has_gradient());
      const std::vector<double> part = parameter.value.gradient().to_host<double>();
      values.insert(values.end(), part.begin(), part.end());
      Tensor(parameter.value).clear_gradient();
    }
    return values;
  };
  const std::vector<double> first = gradients();
  const size_t allocations = device.memory_statistics().device_allocations;
  CHECK(gradients() == first);
  CHECK(device.memory_statistics().device_allocations == allocations);
}

TEST_CASE("wrong sizes are refused") {
  Device& device = test::device(KernelSet::Wide);
  const NetConfig config = small_config();
  CHECK_THROWS_AS(AvatarNet(device, config, code_size, all_masks(device, 256), 1), Error);
  AvatarNet net = make_net(device, config);
  Tape tape(device, false);
  AvatarNet::Inputs inputs = random_inputs(device, 1);
  inputs.face_code = Tensor();
  CHECK_THROWS_AS(net.encode(tape, inputs), std::logic_error);
}
