#include "host/ops/skinning.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace degas {
namespace {

struct SkinningSizes {
  int count, influences, joints;
};

SkinningSizes checked_sizes(const char* operation, const Tensor& points, int64_t components,
                            const SkinningWeights& skinning, const JointTransforms& transforms) {
  const int64_t count = skinning.joints.dim(0), joints = transforms.rotations.dim(0);
  if (points.size() != count * components || skinning.weights.shape() != skinning.joints.shape() ||
      transforms.matrices.size() != joints * 12) {
    throw std::logic_error(
        fmt::format("[{}] needs points (N,{}), joints and weights (N,K), matrices (J,3,4); got {}, {}, {}, {}",
                    operation, components, to_string(points.shape()), to_string(skinning.joints.shape()),
                    to_string(skinning.weights.shape()), to_string(transforms.matrices.shape())));
  }
  return {static_cast<int>(count), static_cast<int>(skinning.joints.dim(1)), static_cast<int>(joints)};
}

template <typename... Arguments>
void launch_skinning(Device& device, const char* name, int items, const Arguments&... arguments) {
  device.kernel("skinning", name).launch({static_cast<size_t>(items)}, {64}, arguments...);
}

/// Runs a kernel of sums per joint over blocks of Gaussians, then adds the blocks in order into `target`.
void sum_by_joint(Device& device, const char* name, const Tensor& gradient, const Tensor& other,
                  const SkinningWeights& skinning, const SkinningSizes& sizes, const Tensor& target) {
  // A CPU item strides through a whole array of joints, so its blocks are large; a GPU wants many small ones.
  const int most_blocks = device.is_wide() ? 32 : 512, smallest_block = device.is_wide() ? 512 : 64;
  const int block_size = std::max(smallest_block, (sizes.count + most_blocks - 1) / most_blocks);
  const int blocks = (sizes.count + block_size - 1) / block_size;
  const int elements = static_cast<int>(target.size());
  const Tensor partial(device, {blocks, elements});
  const size_t joints = sizes.joints, block_items = blocks;
  device.kernel("skinning", name)
      .launch(device.is_wide() ? Range{block_items} : Range{joints, block_items},
              device.is_wide() ? Range{1} : Range{64, 1}, gradient, other, skinning.joints, skinning.weights, partial,
              sizes.count, sizes.influences, sizes.joints, block_size);
  launch_skinning(device, "skin_sum_partials", elements, partial, target, elements, blocks);
}

}  // namespace

Tensor skin_positions(Tape& tape, const Tensor& positions, const SkinningWeights& skinning,
                      const JointTransforms& transforms) {
  const SkinningSizes sizes = checked_sizes("skin_positions", positions, 3, skinning, transforms);
  const Tensor output(tape.device(), positions.shape());
  launch_skinning(tape.device(), "skin_positions_forward", sizes.count, positions, skinning.joints, skinning.weights,
                  transforms.matrices, output, sizes.count, sizes.influences);
  tape.record("skin_positions", {positions, transforms.matrices}, {output}, [=](Tape& tape) {
    const Tensor gradient = output.gradient();
    tape.accumulate(positions, [&](const Tensor& d_positions) {
      launch_skinning(tape.device(), "skin_positions_backward", sizes.count, gradient, skinning.joints,
                      skinning.weights, transforms.matrices, d_positions, sizes.count, sizes.influences);
    });
    tape.accumulate(transforms.matrices, [&](const Tensor& d_matrices) {
      sum_by_joint(tape.device(), "skin_matrices_partial", gradient, positions, skinning, sizes, d_matrices);
    });
  });
  return output;
}

Tensor skin_rotations(Tape& tape, const Tensor& rotations, const SkinningWeights& skinning,
                      const JointTransforms& transforms) {
  const SkinningSizes sizes = checked_sizes("skin_rotations", rotations, 4, skinning, transforms);
  const Tensor output(tape.device(), rotations.shape());
  launch_skinning(tape.device(), "skin_rotations_forward", sizes.count, rotations, skinning.joints, skinning.weights,
                  transforms.rotations, output, sizes.count, sizes.influences);
  tape.record("skin_rotations", {rotations, transforms.rotations}, {output}, [=](Tape& tape) {
    Device& device = tape.device();
    const Tensor d_rotations(device, rotations.shape()), d_blend(device, rotations.shape());
    launch_skinning(device, "skin_rotations_backward", sizes.count, output.gradient(), rotations, skinning.joints,
                    skinning.weights, transforms.rotations, d_rotations, d_blend, sizes.count, sizes.influences);
    tape.accumulate(rotations,
                    [&](const Tensor& target) { device.copy(d_rotations.memory(), target.memory(), target.bytes()); });
    tape.accumulate(transforms.rotations, [&](const Tensor& d_joints) {
      sum_by_joint(device, "skin_rotations_partial", d_blend, transforms.rotations, skinning, sizes, d_joints);
    });
  });
  return output;
}

}  // namespace degas
