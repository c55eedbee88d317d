#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// The decoder's output maps, NHWC, (R,R,C) or (1,R,R,C).
struct AssemblyMaps {
  Tensor positions;         ///< C = 3: d_mu
  Tensor rotations_scales;  ///< C = 7: d_q (w,x,y,z), then d_s
  Tensor colors_opacities;  ///< C = 4: colour, then the opacity's logit
  Tensor harmonics;         ///< C = 3 K, colour fastest, of colors_seen_from; or undefined
};

/// What the heads are offsets from, for the N covered texels.
struct GaussianBase {
  Tensor texels;      ///< Int32 (N): row * R + column, no texel twice
  Tensor positions;   ///< (N,3) metres, canonical pose
  Tensor rotations;   ///< (N,4) unit quaternions w,x,y,z
  Tensor log_scales;  ///< (N,3) ln of metres
};

struct AssemblyOptions {
  double offset_scale = 0.05;    ///< metres of position per unit of d_mu
  double rotation_scale = 0.05;  ///< quaternion change per unit of d_q
};

/// Gaussians in the canonical pose.
struct CanonicalGaussians {
  Tensor positions;       ///< (N,3) metres
  Tensor rotations;       ///< (N,4) unit quaternions
  Tensor log_scales;      ///< (N,3)
  Tensor opacities;       ///< (N) 0..1
  Tensor colors;          ///< (N,3), at least 0
  Tensor offsets;         ///< (N,3): d_mu of the covered texels, for the loss's offset and drift terms
  Tensor opacity_logits;  ///< (N), for the loss's opacity term
  Tensor harmonics;       ///< (N,K,3), or undefined
};

/// Gathers the covered texels of the maps and adds them to the base (method.md, "Gaussian maps and posing"):
///   mu = mu0 + offset_scale d_mu;  q = normalise(q0 + rotation_scale d_q);  log s = log s0 + d_s;
///   opacity = sigmoid(logit);  colour = max(0, 0.5 + 0.2821 colour);  harmonics = 0.1 harmonics
/// Gradients reach the maps, and are zero at texels that are not covered; the base gets none.
/// Throws std::logic_error when shapes disagree.
CanonicalGaussians assemble(Tape& tape, const AssemblyMaps& maps, const GaussianBase& base,
                            const AssemblyOptions& options = {});

}  // namespace degas
