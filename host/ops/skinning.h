#pragma once

#include "host/ops/kinematics.h"

namespace degas {

/// Which joints move each of N points, and how much. Heaviest first, weights sum to 1; unused places hold weight 0 and
/// any valid joint.
struct SkinningWeights {
  Tensor joints;   ///< Int32 (N,K)
  Tensor weights;  ///< (N,K)
};

/// Linear blend skinning of positions (N,3), metres, with the full transforms. The gradient reaches positions and
/// transforms.matrices. Throws std::logic_error when shapes disagree.
Tensor skin_positions(Tape& tape, const Tensor& positions, const SkinningWeights& skinning,
                      const JointTransforms& transforms);

/// Turns rotations (N,4), quaternions (w,x,y,z) of any norm, by the joints: a true rotation from the sign-aligned,
/// normalised blend of the joints' quaternions, composed from the left; norms are kept. A blend of matrices would be no
/// rotation and collapses at a twist of 180 degrees (arXiv 2509.11411). The gradient reaches rotations and
/// transforms.rotations. Throws std::logic_error when shapes disagree.
Tensor skin_rotations(Tape& tape, const Tensor& rotations, const SkinningWeights& skinning,
                      const JointTransforms& transforms);

}  // namespace degas
