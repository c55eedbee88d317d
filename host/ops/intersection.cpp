#include "host/ops/intersection.h"

#include <bit>
#include <limits>

#include "host/error.h"
#include "host/ops/radix_sort.h"

namespace degas {
namespace {

template <typename... Arguments>
void launch(Device& device, const char* name, const Range& items, const Arguments&... arguments) {
  device.kernel("intersection", name, {{"TILE_WIDTH", splat_tile_width}, {"TILE_HEIGHT", splat_tile_height}})
      .launch(items, device.pointwise_local(), arguments...);
}

}  // namespace

int64_t checked_intersection_count(const Tensor& totals, int64_t total_index, const Camera& camera) {
  uint64_t total = 0;
  totals.device().download(totals.memory(), &total, sizeof(total), total_index * sizeof(total));
  if (total > static_cast<uint64_t>(std::numeric_limits<int32_t>::max())) {
    throw Error::format(
        "splatting {}x{} pixels: {} intersections of splats and tiles, the limit is 2147483647; use fewer or smaller "
        "splats, or "
        "draw the image in parts",
        camera.width, camera.height, total);
  }
  return static_cast<int64_t>(total);
}

Intersections intersect_tiles(SplatWorkspace& workspace, const ProjectedSplats& projected, const Camera& camera) {
  Device& device = projected.records.device();
  const int64_t splats = projected.depth_keys.size();
  Intersections result;
  result.columns = (camera.width + splat_tile_width - 1) / splat_tile_width;
  result.rows = (camera.height + splat_tile_height - 1) / splat_tile_height;
  const int tiles = result.columns * result.rows;

  // Slots are numbered in the order of depth, so a stable sort by tile leaves each tile's list front to back.
  const Tensor depth_order = radix_sort(projected.depth_keys, splats).places;
  const Range ranks = device.pointwise_global(splats);
  const Tensor sorted_counts(device, {splats}, Element::UInt32);
  launch(device, "count_tiles", ranks, projected.records, depth_order, sorted_counts, camera.width, camera.height,
         splats);
  const Scan offsets = exclusive_scan(sorted_counts);
  result.count = checked_intersection_count(offsets.totals, offsets.total_index, camera);

  const Shape capacity = {workspace.reserve(result.count)};
  const Tensor tile_keys(device, capacity, Element::UInt32);
  result.slot_splats = Tensor(device, capacity, Element::UInt32);
  result.slot_counts = Tensor(device, {splats}, Element::UInt32);
  result.slot_offsets = Tensor(device, {splats}, Element::UInt32);
  launch(device, "list_tiles", ranks, projected.records, depth_order, sorted_counts, offsets.sums, tile_keys,
         result.slot_splats, result.slot_counts, result.slot_offsets, camera.width, camera.height, splats);
  const SortedKeys by_tile = radix_sort(tile_keys, result.count, std::bit_width(static_cast<unsigned>(tiles)));
  result.order = by_tile.places;
  result.tile_starts = Tensor(device, {tiles + 1}, Element::UInt32);
  launch(device, "find_tile_starts", {static_cast<size_t>(tiles) + 1}, by_tile.keys, result.tile_starts, tiles,
         static_cast<uint32_t>(result.count));
  return result;
}

}  // namespace degas
