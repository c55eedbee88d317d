#include "host/ops/intersection.h"

#include <cmath>
#include <set>
#include <string>

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
      const double t = record[4] * dy;
      if (record[5] - s * s - t * t >= std::log2(1.0 / 255)) {
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
  SplatScene scene = random_scene(GENERATE(300, 3000), 8);                // one chunk of the listing, and several
  scene.add({0, 0, 3}, {1, 0.1, 0.2, 0.9}, {1, -7, -7}, 0.9, {1, 1, 1});  // a needle across the image
  scene.add({0, 0, 5}, {1, 0.1, 0.2, 0.9}, {2, 1, 1}, 0.9, {1, 1, 1});    // more tiles than a box holds
  SplatWorkspace workspace;
  // The second view has another size: its splats and tiles are numbered behind those of the first.
  const SplatViews views = upload_views(device, {{camera}, {test_camera(67, 131)}}, {});
  const ProjectedSplats projected = project_splats(workspace, scene.upload(device), views, {});
  const Intersections found = intersect_tiles(workspace, projected, views);
  const std::vector<double> records = projected.records.to_host<double>();
  const auto slots_of = found.slots_of.to_host<int32_t>(), entries = found.entries.to_host<int32_t>(),
             starts = found.tile_starts.to_host<int32_t>(), depths = projected.depth_keys.to_host<int32_t>();

  const int64_t projections = 2 * scene.count();
  std::vector<std::set<int>> listed(projections);
  std::set<int> slots;
  CHECK(starts.front() == 0);
  REQUIRE(starts.back() == found.count);
  for (int tile = 0; tile < views.tiles(); ++tile) {
    for (int i = starts[tile]; i < starts[tile + 1]; ++i) {
      const int splat = entries[2 * i], slot = entries[2 * i + 1];
      const int view = splat / static_cast<int>(scene.count());
      CHECK((tile >= views.first_tiles[view] && tile < views.first_tiles[view + 1]));
      CHECK(listed[splat].insert(tile - views.first_tiles[view]).second);
      CHECK(slots.insert(slot).second);
      CHECK((slot >= slots_of[2 * splat] && slot < slots_of[2 * splat] + slots_of[2 * splat + 1]));
      if (i > starts[tile]) {
        const int before = entries[2 * i - 2];
        CHECK(std::pair(depths[before], before) < std::pair(depths[splat], splat));
      }
    }
  }
  CHECK(static_cast<int64_t>(slots.size()) == found.count);
  int64_t needed = 0;
  for (int64_t n = 0; n < projections; ++n) {
    const int64_t view = n / scene.count();
    CHECK(static_cast<int>(listed[n].size()) == slots_of[2 * n + 1]);
    const std::set<int> reached = tiles_reached(&records[16 * n], views.views[view].camera, views.columns(view));
    needed += static_cast<int64_t>(reached.size());
    CHECK(std::includes(listed[n].begin(), listed[n].end(), reached.begin(), reached.end()));
  }
  CHECK(found.count < needed * 11 / 10);
}

TEST_CASE("more intersections than 2^31 - 1 are refused with a clear error") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const SplatViews views = upload_views(device, {{test_camera(640, 480)}}, {});
  Tensor counts(device, {2500}, Element::UInt32);
  counts.upload(std::span<const int32_t>(std::vector<int32_t>(2500, 1000000)));
  const Scan scan = exclusive_scan(counts, counts.size());
  uint64_t total = 0;
  device.download(scan.totals.memory(), &total, sizeof(total), scan.total_index * sizeof(total));
  CHECK_NOTHROW(require_countable(2147483647, views));
  CHECK_THROWS_AS(require_countable(total, views), Error);
  CHECK_THROWS_WITH(require_countable(total, views), Catch::Contains("640x480") && Catch::Contains("2500000000"));
}

TEST_CASE("splats that cover an image so often that their tiles cannot be counted end in that error", "[large]") {
  // The GPU set's count is the scan above; the wide set adds the totals of its chunks up by itself.
  Device& device = test::device(KernelSet::Wide);
  const Camera camera = test_camera(4096, 3000);
  SplatScene scene;
  for (int i = 0; i < 45'000; ++i) scene.add({0, 0, 3}, {1, 0, 0, 0}, {6, 6, 6}, 0.9, {1, 1, 1});
  SplatWorkspace workspace;
  const SplatViews views = upload_views(device, {{camera}}, {});
  const ProjectedSplats projected = project_splats(workspace, scene.upload(device), views, {});
  CHECK_THROWS_WITH(intersect_tiles(workspace, projected, views),
                    Catch::Contains("4096x3000") && Catch::Contains(std::to_string(int64_t{45'000} * views.tiles())));
}

TEST_CASE("the workspace grows with slack and never shrinks") {
  SplatWorkspace workspace;
  CHECK(workspace.reserve(0) == 0);
  CHECK(workspace.reserve(10000) == 15000);
  CHECK(workspace.reserve(14000) == 15000);
  CHECK(workspace.reserve(20000) == 30000);
  CHECK(workspace.capacity() == 30000);
}
