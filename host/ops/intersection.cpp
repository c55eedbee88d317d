#include "host/ops/intersection.h"

#include <bit>
#include <limits>
#include <numeric>

#include "host/error.h"
#include "host/ops/radix_sort.h"

namespace degas {
namespace {

/// Depth keys are the bits of positive floats, but for those of culled splats, which touch no tile.
constexpr int depth_bits = 31;

/// What the stages of both kernel sets work on.
struct Lists {
  Device& device;
  SplatWorkspace& workspace;
  const ProjectedSplats& projected;
  const SplatViews& views;
  const Tensor order;     ///< splats of all views by depth
  const uint32_t all;     ///< splats of all views
  const uint32_t splats;  ///< of a view
  const uint32_t tiles;

  Kernel kernel(const char* file, const char* name) const {
    return device.kernel(file, name, {{"TILE_WIDTH", splat_tile_width}, {"TILE_HEIGHT", splat_tile_height}});
  }

  /// Checks the count and makes room for as many intersections.
  Intersections make_room(uint64_t count) const {
    require_countable(count, views);
    Intersections result;
    result.count = static_cast<int64_t>(count);
    result.slots_of = Tensor(device, {projected.records.dim(0), 2}, Element::UInt32);
    result.entries = Tensor(device, {workspace.reserve(result.count), 2}, Element::UInt32);
    result.tile_starts = Tensor(device, {workspace.reserve_tiles(tiles) + 1}, Element::UInt32);
    return result;
  }
};

Intersections list_wide(const Lists& lists) {
  Device& device = lists.device;
  const Chunks chunks = long_chunks(device, lists.all);
  const int64_t chunk_room = long_chunks(device, lists.projected.records.dim(0)).count;
  const Tensor tile_counts(device, {chunk_room, lists.workspace.reserve_tiles(lists.tiles)}, Element::UInt32);
  const Tensor chunk_totals(device, {chunk_room}, Element::UInt64);
  const auto launch = [&](const char* name, const auto&... results) {
    lists.kernel("intersection_wide", name)
        .launch({chunks.count}, {1}, lists.projected.tile_boxes, lists.order, lists.projected.records,
                lists.views.on_device, tile_counts, chunk_totals, results..., lists.splats, lists.tiles, chunks.size,
                chunks.count, lists.all);
  };
  launch("count_tiles");
  std::vector<uint64_t> totals(chunks.count);
  device.download(chunk_totals.memory(), totals.data(), totals.size() * sizeof(uint64_t));
  const Intersections result = lists.make_room(std::accumulate(totals.begin(), totals.end(), uint64_t{0}));
  const Tensor cursors(device, tile_counts.shape(), Element::UInt32);
  launch("list_tiles", cursors, result.tile_starts, result.entries, result.slots_of);
  return result;
}

Intersections list_gpu(const Lists& lists) {
  Device& device = lists.device;
  const auto launch = [&](const char* name, size_t items, const auto&... arguments) {
    lists.kernel("intersection_gpu", name).launch({items}, device.pointwise_local(), arguments...);
  };
  const Tensor &records = lists.projected.records, &views = lists.views.on_device;
  // As large as the records, which fewer views do not make smaller.
  const Tensor sorted_counts(device, {records.dim(0)}, Element::UInt32);
  launch("count_tiles", lists.all, records, views, lists.order, sorted_counts, lists.splats, lists.all);
  const Scan offsets = exclusive_scan(sorted_counts, lists.all);
  uint64_t total = 0;
  device.download(offsets.totals.memory(), &total, sizeof(total), offsets.total_index * sizeof(total));
  const Intersections result = lists.make_room(total);
  const Shape capacity = {result.entries.dim(0)};
  const Tensor slot_tiles(device, capacity, Element::UInt32), slot_splats(device, capacity, Element::UInt32);
  launch("list_tiles", lists.all, records, views, lists.order, sorted_counts, offsets.sums, slot_tiles, slot_splats,
         result.slots_of, lists.splats, lists.all);
  // Slots are numbered in the order of depth, so a stable sort by tile leaves each tile's list front to back.
  const Tensor slot_order = sorted_places(slot_tiles, result.count, std::bit_width(lists.tiles));
  launch("gather_entries", static_cast<size_t>(result.count) + 1, slot_tiles, slot_splats, slot_order, result.entries,
         result.tile_starts, lists.tiles, static_cast<uint32_t>(result.count));
  return result;
}

}  // namespace

void require_countable(uint64_t intersections, const SplatViews& views) {
  if (intersections <= static_cast<uint64_t>(std::numeric_limits<int32_t>::max())) return;
  const Camera& camera = views.views.front().camera;
  throw Error::format(
      "splatting {} view(s) of {}x{} pixels: {} intersections of splats and tiles, the limit is 2147483647; use fewer or "
      "smaller splats, fewer views at once, or draw the image in parts",
      views.count(), camera.width, camera.height, intersections);
}

Intersections intersect_tiles(SplatWorkspace& workspace, const ProjectedSplats& projected, const SplatViews& views) {
  Device& device = projected.records.device();
  const int64_t all = projected.count;
  const Lists lists{device,
                    workspace,
                    projected,
                    views,
                    sorted_places(projected.depth_keys, all, depth_bits),
                    static_cast<uint32_t>(all),
                    static_cast<uint32_t>(all / views.count()),
                    static_cast<uint32_t>(views.tiles())};
  return device.is_wide() ? list_wide(lists) : list_gpu(lists);
}

}  // namespace degas
