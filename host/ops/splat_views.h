#pragma once

#include <vector>

#include "host/ops/splat.h"

namespace degas {

constexpr int splat_tile_width = 16, splat_tile_height = 16;  ///< pixels

/// The views of one call of splat(), for its stages.
struct SplatViews {
  std::vector<SplatView> views;
  Tensor on_device;              ///< kernels/common/view.cl
  std::vector<int> first_tiles;  ///< of each view, as tiles are numbered through all of them; last: how many in all

  int64_t count() const { return static_cast<int64_t>(views.size()); }
  int tiles() const { return first_tiles.back(); }
  int columns(int64_t view) const { return (views[view].camera.width + splat_tile_width - 1) / splat_tile_width; }
  int rows(int64_t view) const { return (views[view].camera.height + splat_tile_height - 1) / splat_tile_height; }
};

SplatViews upload_views(Device& device, std::vector<SplatView> views, const SplatOptions& options);

}  // namespace degas
