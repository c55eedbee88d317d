// Assembly, kinematics and skinning at the sizes of the full and quick configurations: forward, forward + backward to
// the maps ("step"), and to the pose as well. Times include the host's part. Little is computed here, so rates are
// those of memory.
#include <fmt/format.h>

#include <functional>

#include "bench/support/harness.h"
#include "host/ops/assembly.h"
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
    maps = {numbers(device, {1, side, side, 3}),
            numbers(device, {1, side, side, 7}),
            numbers(device, {1, side, side, 4}),
            {}};
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

}  // namespace

int main(int count, char** values) {
  Bench bench(count, values, "assembly, kinematics, skinning");
  Device& device = bench.device;
  for (int side : {256, 512}) {
    Subject subject(device, side);
    const auto gaussians = static_cast<double>(subject.base.texels.size()), texels = static_cast<double>(side) * side;
    std::vector<Tensor> leaves;
    // numbers: floats and indices that the row must read and write.
    const auto add_row = [&](const char* name, double numbers_moved,
                             const std::function<std::vector<Tensor>(Tape&)>& forward) {
      Row row;
      row.name = fmt::format("{}/{}", side, name);
      row.gigabytes = 4e-9 * numbers_moved;
      if (leaves.empty()) {
        return bench.run(row, [&] {
          Tape tape(device, false);
          forward(tape);
        });
      }
      std::vector<Tensor> gradients;
      Tape silent(device, false);
      for (const Tensor& output : forward(silent)) gradients.push_back(numbers(device, output.shape()));
      bench.run(row, [&] {
        Tape tape(device);
        tape.backward(forward(tape), gradients);
        for (Tensor& leaf : leaves) leaf.clear_gradient();
      });
    };
    const auto want_gradients = [&](const std::vector<Tensor*>& tensors) {
      for (Tensor* tensor : tensors) leaves.push_back(tensor->set_requires_gradient());
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
    // Maps 14, base 10, texel 1 -> Gaussian 14, offset 3, logit 1. Back: gradient 14, maps and base 12, texel 1 ->
    // maps.
    const double assembly = 43 * gaussians, assembly_back = 27 * gaussians + 14 * texels;
    // Angles 3, rest joint 3, parent 1 -> matrix 12, quaternion 4. Back: those and their gradients -> angles 3.
    const double chain = 23 * joints, chain_back = 42 * joints;
    // A point and a quaternion to and fro, each with its joints and weights; back, the quaternion is read too.
    const double skin = (2 * 7 + 4 * influences) * gaussians, skin_back = skin + 4 * gaussians;
    // Sums by joint: gradients, points and the blend's gradient, each again with joints and weights.
    const double skin_pose_back = (3 + 3 + 2 * 4 + 4 * influences) * gaussians;
    add_row("assembly.forward", assembly, assembled);
    add_row("kinematics.forward", chain, kinematics_alone);
    add_row("skinning.forward", skin, skinned);
    want_gradients({&subject.maps.positions, &subject.maps.rotations_scales, &subject.maps.colors_opacities,
                    &subject.base.positions, &subject.base.rotations});
    add_row("assembly.step", assembly + assembly_back, assembled);
    add_row("skinning.step", skin + skin_back, skinned);
    want_gradients({&subject.axis_angles, &subject.translation});
    add_row("kinematics.step", chain + chain_back, kinematics_alone);
    add_row("skinning.step_with_pose", chain + chain_back + skin + skin_back + skin_pose_back, skinned);
  }
  bench.finish();
}
