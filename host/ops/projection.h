#pragma once

#include "host/ops/splat_views.h"

namespace degas {

struct Intersections;

/// Splats as each view sees them: splat n of view k is number k N + n. The tensors may be longer.
struct ProjectedSplats {
  int64_t count = 0;  ///< views N
  Tensor records;     ///< (count,16), kernels/common/splat.cl
  Tensor depth_keys;  ///< UInt32 (count): ascending with depth; all ones for culled splats
  Tensor tile_boxes;  ///< UInt32 (count,4), kernels/common/tile_box.cl; undefined in the GPU set
};

/// kernels/projection.cl. Stages of splat(), without a tape: shapes as there; colours may also be (views,N,3).
ProjectedSplats project_splats(SplatWorkspace& workspace, const Splats& splats, const SplatViews& views,
                               const SplatOptions& options);

/// Sums each splat's slots (M,16) in order, over all views, and writes the gradients of the fields; undefined tensors
/// are left out.
void project_splats_backward(const Splats& splats, const Intersections& intersections, const Tensor& slots,
                             const SplatViews& views, const SplatOptions& options, const Splats& gradients);

}  // namespace degas
