#include "host/ops/intersection.h"

#include <cmath>
#include <set>

#include "host/error.h"
#include "host/ops/radix_sort.h"
#include "tests/support/splat_reference.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

/// Tiles with a pixel centre where the record's alpha reaches 1/255, found by trying every pixel.
std::set<int> tiles_reached(const double* record, const Camera& camera, int columns) {
  std::set<int> tiles;
  if (!(record[6] >= 0)) return tiles;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const double dx = column + 0.5 - record[0], dy = row + 0.5 - record[1], s = record[2] * (dx - record[3] * dy);
      if (record[5] - s * s - record[4] * dy * dy >= std::log2(1.0 / 255)) {
        tiles.insert(row / splat_tile_height * columns + column / splat_tile_width);
      }
    }
  }
  return tiles;
}

}  // namespace

TEST_CASE("every tile that a splat reaches is listed, few others, all front to back") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Camera camera = test_camera(150, 83);
  SplatScene scene = random_scene(300, 8);
  scene.add({0, 0, 3}, {1, 0.1, 0.2, 0.9}, {1, -7, -7}, 0.9, {1, 1, 1});  // a needle across the image
  SplatWorkspace workspace;
  const ProjectedSplats projected = project_splats(scene.upload(device), camera, {});
  const Intersections found = intersect_tiles(workspace, projected, camera);
  const std::vector<double> records = projected.records.to_host<double>();
  const auto counts = found.slot_counts.to_host<int32_t>(), offsets = found.slot_offsets.to_host<int32_t>(),
             owners = found.slot_splats.to_host<int32_t>(), order = found.order.to_host<int32_t>(),
             starts = found.tile_starts.to_host<int32_t>(), depths = projected.depth_keys.to_host<int32_t>();

  std::vector<std::set<int>> listed(scene.count());
  CHECK(starts.front() == 0);
  REQUIRE(starts.back() == found.count);
  for (int tile = 0; tile < found.columns * found.rows; ++tile) {
    for (int i = starts[tile]; i < starts[tile + 1]; ++i) {
      const int slot = order[i], splat = owners[slot];
      CHECK(listed[splat].insert(tile).second);
      CHECK((slot >= offsets[splat] && slot < offsets[splat] + counts[splat]));
      if (i > starts[tile]) {
        const int before = owners[order[i - 1]];
        CHECK(std::pair(depths[before], before) < std::pair(depths[splat], splat));
      }
    }
  }
  int64_t needed = 0;
  for (int64_t n = 0; n < scene.count(); ++n) {
    CHECK(static_cast<int>(listed[n].size()) == counts[n]);
    const std::set<int> reached = tiles_reached(&records[16 * n], camera, found.columns);
    needed += static_cast<int64_t>(reached.size());
    CHECK(std::includes(listed[n].begin(), listed[n].end(), reached.begin(), reached.end()));
  }
  CHECK(found.count < needed * 11 / 10);
}

TEST_CASE("more intersections than 2^31 - 1 are refused with a clear error") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  Tensor counts(device, {2500}, Element::UInt32);
  counts.upload(std::span<const int32_t>(std::vector<int32_t>(2500, 1000000)));
  const Scan scan = exclusive_scan(counts);
  CHECK_THROWS_AS(checked_intersection_count(scan.totals, scan.total_index, test_camera(640, 480)), Error);
  CHECK_THROWS_WITH(checked_intersection_count(scan.totals, scan.total_index, test_camera(640, 480)),
                    Catch::Contains("640x480") && Catch::Contains("2500000000"));
}

TEST_CASE("the workspace grows with slack and never shrinks") {
  SplatWorkspace workspace;
  CHECK(workspace.reserve(0) == 0);
  CHECK(workspace.reserve(10000) == 15000);
  CHECK(workspace.reserve(14000) == 15000);
  CHECK(workspace.reserve(20000) == 30000);
  CHECK(workspace.capacity() == 30000);
}
