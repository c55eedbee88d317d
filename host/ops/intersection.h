#pragma once

#include "host/ops/projection.h"

namespace degas {

constexpr int splat_tile_width = 16, splat_tile_height = 16;  ///< pixels

/// The tiles each splat touches. A slot is one (tile, splat) intersection; the slots of a splat are consecutive.
struct Intersections {
  int64_t count = 0;                 ///< M; the tensors by slot are larger: as large as the workspace's capacity
  int columns = 0, rows = 0;         ///< tiles
  Tensor slot_counts, slot_offsets;  ///< UInt32 (N): a splat's slots
  Tensor slot_splats;                ///< UInt32 (capacity): the splat of a slot
  Tensor order;                      ///< UInt32 (capacity): slots by tile, front to back within one
  Tensor tile_starts;                ///< UInt32 (tiles + 1): a tile's part of `order`
};

/// kernels/intersection.cl: sorts by depth, lists the tiles of each splat, sorts them stably by tile. Reads the number
/// of intersections back; throws Error when it exceeds 2^31 - 1.
Intersections intersect_tiles(SplatWorkspace& workspace, const ProjectedSplats& projected, const Camera& camera);

/// Sum of a view's intersections (UInt32, any count), read back. Throws Error when it exceeds 2^31 - 1.
int64_t checked_intersection_count(const Tensor& totals, int64_t total_index, const Camera& camera);

}  // namespace degas
