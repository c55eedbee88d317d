#pragma once

#include "host/ops/assembly.h"
#include "host/ops/skinning.h"
#include "host/ops/splat.h"
#include "model/body/body_model.h"
#include "model/gaussians/base_maps.h"

namespace degas {

/// A person's joints in the rest pose, on the device.
struct Skeleton {
  Tensor rest_joints;  ///< (J,3) metres
  Tensor parents;      ///< Int32 (J)
};

Skeleton make_skeleton(Device& device, const BodyModel& body, const std::vector<double>& betas);

/// A frame's pose on the device. Give both tensors set_requires_gradient() to refine it.
struct DevicePose {
  Tensor axis_angles;  ///< (J,3) radians, root included
  Tensor translation;  ///< (3) metres
};

DevicePose make_device_pose(Device& device, const Pose& pose);

/// Base maps on the device: what assembly adds to, and what skinning weighs by.
GaussianBase make_gaussian_base(Device& device, const BaseMaps& maps);
SkinningWeights make_skinning_weights(Device& device, const BaseMaps& maps);

/// Canonical Gaussians in the world: positions by the full transforms, rotations by the true rotation of the blend from
/// the left, root rotation and translation included. Shape, opacity and colour stay.
Splats pose_gaussians(Tape& tape, const CanonicalGaussians& gaussians, const SkinningWeights& skinning,
                      const Skeleton& skeleton, const DevicePose& pose);

}  // namespace degas
