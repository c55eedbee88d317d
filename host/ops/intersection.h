#pragma once

#include "host/ops/projection.h"

namespace degas {

/// The tiles each splat touches in each view. A slot is one (tile, splat) intersection; the slots of a splat are
/// consecutive. Splats and tiles are numbered through all views.
struct Intersections {
  int64_t count = 0;   ///< M; the capacity is larger
  Tensor slots_of;     ///< UInt32 (views N or more,2): a splat's first slot and number of slots
  Tensor entries;      ///< UInt32 (capacity,2): splat and slot, by tile, front to back within one
  Tensor tile_starts;  ///< UInt32 (tiles + 1 or more): a tile's part of `entries`
};

/// kernels/intersection_wide.cl and intersection_gpu.cl: sorts by depth, lists the tiles of each splat by tile. Reads
/// the number of intersections back; throws Error when it exceeds 2^31 - 1.
Intersections intersect_tiles(SplatWorkspace& workspace, const ProjectedSplats& projected, const SplatViews& views);

/// Throws Error when there are more intersections than 2^31 - 1.
void require_countable(uint64_t intersections, const SplatViews& views);

}  // namespace degas
