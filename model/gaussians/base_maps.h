#pragma once

#include <cstdint>
#include <vector>

#include "model/body/body_model.h"
#include "model/body/uv_atlas.h"
#include "model/config.h"

namespace degas {

/// Where each Gaussian starts on the canonical body: one per covered texel, in the order of UvAtlas::covered.
struct BaseMaps {
  int resolution = 0;             ///< R of the atlas
  std::vector<int32_t> covered;   ///< (N) row * R + column
  std::vector<float> positions;   ///< (N, 3) mu0, metres
  std::vector<float> rotations;   ///< (N, 4) q0, unit quaternions w, x, y, z with w >= 0
  std::vector<float> log_scales;  ///< (N, 3) s0, log metres
  int influences = 0;             ///< K
  std::vector<int32_t> joints;    ///< (N, K) by falling weight; unused places repeat the first joint at weight 0
  std::vector<float> weights;     ///< (N, K), each row sums to 1
};

/// method.md, "Gaussian maps and posing", on the body at rest with a neutral face. Position: barycentric. Rotation:
/// z is the interpolated vertex normal, x an edge of the triangle made orthogonal to it: of the three edges the one
/// that runs most along +u, so that neighbours agree; both are area-weighted to the vertices (x to the texture's
/// vertices, as seams turn +u). Scale: root mean squared distance to the three nearest Gaussians, `thin_axis` metres
/// along z. K is `max_influences` or the largest number of joints at any texel, whichever is less; weights beyond the K
/// largest are dropped and the rest made to sum to 1. Error when fewer than four texels are covered.
BaseMaps make_base_maps(const BodyModel& body, const std::vector<double>& betas, const UvAtlas& atlas,
                        int max_influences, double thin_axis,
                        SkinningInterpolation skinning = SkinningInterpolation::Barycentric);

/// Makes the Gaussians balls, as thick as they are wide.
void make_isotropic(BaseMaps& maps);

}  // namespace degas
