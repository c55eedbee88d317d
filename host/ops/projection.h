#pragma once

#include "host/ops/splat.h"

namespace degas {

struct Intersections;

/// Splats as a camera sees them (record layout: kernels/common/splat.cl).
struct ProjectedSplats {
  Tensor records;     ///< (N,16)
  Tensor depth_keys;  ///< UInt32 (N): ascending with depth; all ones for culled splats
};

/// kernels/projection.cl. Stages of splat(), without a tape: shapes as there.
ProjectedSplats project_splats(const Splats& splats, const Camera& camera, const SplatOptions& options);

/// Sums each splat's slots (M,16) in order and writes the gradients of the fields; undefined tensors are left out.
void project_splats_backward(const Splats& splats, const Intersections& intersections, const Tensor& slots,
                             const Camera& camera, const SplatOptions& options, const Splats& gradients);

}  // namespace degas
