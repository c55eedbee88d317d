// Assembly, kinematics and skinning at the sizes of the full and quick configurations: forward, backward to the maps,
// and backward to the pose as well. Times include the host's part.
#include <fmt/format.h>

#include <functional>

#include "bench/support/harness.h"
#include "host/ops/assembly.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "host/ops/skinning.h"

using namespace degas;
using namespace degas::bench;

namespace {

constexpr int joints = 55, influences = 8;

Tensor numbers(Device& device, Shape shape) {
  std::vector<float> values(element_count(shape));
  for (size_t i = 0; i < values.size(); ++i) values[i] = 0.01f * static_cast<float>(i % 97) - 0.4f;
  return Tensor::from(device, std::move(shape), std::span<const float>(values));
}

/// Three quarters of the texels covered, neighbours moved by neighbouring joints, as on a body.
struct Subject {
  AssemblyMaps maps;
  GaussianBase base;
  SkinningWeights skinning;
  Tensor axis_angles, translation, rest, parents;

  Subject(Device& device, int side) {
    std::vector<int32_t> texels, indices, tree;
    std::vector<float> weights;
    for (int texel = 0; texel < side * side; ++texel) {
      if (texel % 4 == 3) continue;
      texels.push_back(texel);
      for (int k = 0; k < influences; ++k) {
        indices.push_back((texel / (side * side / joints + 1) + k) % joints);
        weights.push_back(k < 3 ? 1.0f / 3 : 0.0f);
      }
    }
    for (int j = 0; j < joints; ++j) tree.push_back(j == 0 ? -1 : j % 4 == 3 ? j / 4 : j - 1);
    const int64_t count = texels.size();
    maps = {numbers(device, {1, side, side, 3}), numbers(device, {1, side, side, 7}),
            numbers(device, {1, side, side, 4}), {}};
    base = {Tensor::from(device, {count}, std::span<const int32_t>(texels)), numbers(device, {count, 3}),
            numbers(device, {count, 4}), numbers(device, {count, 3})};
    skinning = {Tensor::from(device, {count, influences}, std::span<const int32_t>(indices)),
                Tensor::from(device, {count, influences}, std::span<const float>(weights))};
    axis_angles = numbers(device, {joints, 3});
    translation = numbers(device, {3});
    rest = numbers(device, {joints, 3});
    parents = Tensor::from(device, {joints}, std::span<const int32_t>(tree));
  }
};

/// Runs `forward`, and backward from arbitrary gradients of its outputs where the tape records.
void run(Device& device, bool backward, const std::function<std::vector<Tensor>(Tape&)>& forward) {
  Tape tape(device, backward);
  Tensor loss;
  for (const Tensor& output : forward(tape)) {
    if (!backward) continue;
    const Tensor term = sum(tape, output);
    loss = loss.defined() ? add(tape, loss, term) : term;
  }
  if (backward) tape.backward(loss);
}

}  // namespace

int main(int count, char** values) {
  const Arguments arguments = parse_arguments(count, values);
  DeviceOptions options;
  options.selector = arguments.device;
  Device device(options);
  Report report("assembly, kinematics, skinning", 0);
  for (int side : {256, 512}) {
    Subject subject(device, side);
    const auto add_row = [&](const char* name, bool backward,
                             const std::function<std::vector<Tensor>(Tape&)>& forward) {
      const std::string title = fmt::format("{}/{}", side, name);
      if (title.find(arguments.filter) == std::string::npos) return;
      report.add({title, measure([&] { run(device, backward, forward); }, [&] { device.finish(); }), 0, {}, ""});
    };
    const auto assembled = [&](Tape& tape) {
      const CanonicalGaussians g = assemble(tape, subject.maps, subject.base);
      return std::vector{g.positions, g.rotations, g.log_scales, g.opacities, g.colors};
    };
    const auto transforms = [&](Tape& tape) {
      return kinematics(tape, subject.axis_angles, subject.translation, subject.rest, subject.parents);
    };
    const auto kinematics_alone = [&](Tape& tape) {
      const JointTransforms joint_transforms = transforms(tape);
      return std::vector{joint_transforms.matrices, joint_transforms.rotations};
    };
    const auto skinned = [&](Tape& tape) {
      const JointTransforms joint_transforms = transforms(tape);
      return std::vector{skin_positions(tape, subject.base.positions, subject.skinning, joint_transforms),
                         skin_rotations(tape, subject.base.rotations, subject.skinning, joint_transforms)};
    };
    add_row("assembly.forward", false, assembled);
    add_row("kinematics.forward", false, kinematics_alone);
    add_row("skinning.forward", false, skinned);
    for (Tensor* map : {&subject.maps.positions, &subject.maps.rotations_scales, &subject.maps.colors_opacities,
                        &subject.base.positions, &subject.base.rotations}) {
      map->set_requires_gradient();
    }
    add_row("assembly.step", true, assembled);
    add_row("skinning.step", true, skinned);
    subject.axis_angles.set_requires_gradient();
    subject.translation.set_requires_gradient();
    add_row("kinematics.step", true, kinematics_alone);
    add_row("skinning.step_with_pose", true, skinned);
  }
  report.finish(arguments.json);
}
