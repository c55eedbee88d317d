#include "host/ops/raster.h"

namespace degas {
namespace {

/// Queues a raster kernel for a view; the background, the size and the view's first tile are its last arguments.
template <typename... Arguments>
void launch_raster(const char* name, const SplatViews& views, int64_t view, const SplatOptions& options,
                   const Arguments&... arguments) {
  Device& device = views.on_device.device();
  const auto columns = static_cast<size_t>(views.columns(view)), rows = static_cast<size_t>(views.rows(view));
  const Camera& camera = views.views[view].camera;
  const auto& background = views.views[view].background;
  const auto queue = [&](const Kernel& kernel, const Range& global, const Range& local) {
    kernel.launch(global, local, arguments..., background[0], background[1], background[2], camera.width, camera.height,
                  views.first_tiles[view]);
  };
  const Define smooth("SMOOTH_CUTOFF", options.smooth_cutoff ? 1 : 0);
  if (device.is_wide()) {
    static_assert(splat_tile_width == 16 && splat_tile_height == 16, "raster_wide.cl has tiles of 4x4 blocks of 4x4");
    return queue(device.kernel("raster_wide", name, {smooth}), {columns * rows}, {1});
  }
  // Eight splats a backward round take 29 KB of local memory in float; half as many keep double at 41 KB.
  const Defines defines = {smooth,
                           {"TILE_WIDTH", splat_tile_width},
                           {"TILE_HEIGHT", splat_tile_height},
                           {"BATCH", device.real_bytes() == 8 ? 4 : 8}};
  queue(device.kernel("raster_gpu", name, defines), {columns * splat_tile_width, rows * splat_tile_height},
        {splat_tile_width, splat_tile_height});
}

}  // namespace

std::vector<RasterImage> rasterize(const ProjectedSplats& projected, const Intersections& intersections,
                                   const SplatViews& views, const SplatOptions& options) {
  Device& device = projected.records.device();
  std::vector<RasterImage> images;
  for (int64_t view = 0; view < views.count(); ++view) {
    const Camera& camera = views.views[view].camera;
    const Shape pixels = {camera.height, camera.width};
    images.push_back({Tensor(device, {camera.height, camera.width, 3}), Tensor(device, pixels), Tensor(device, pixels),
                      Tensor(device, pixels, Element::Int32)});
    const RasterImage& image = images.back();
    launch_raster("raster_forward", views, view, options, projected.records, intersections.tile_starts,
                  intersections.entries, image.color, image.alpha, image.transmittance, image.contributors);
  }
  return images;
}

Tensor rasterize_backward(const ProjectedSplats& projected, const Intersections& intersections,
                          const std::vector<RasterImage>& images, const std::vector<RasterGradient>& gradients,
                          const SplatViews& views, const SplatOptions& options) {
  const Tensor slots(projected.records.device(), {intersections.entries.dim(0), 16});
  for (int64_t view = 0; view < views.count(); ++view) {
    launch_raster("raster_backward", views, view, options, projected.records, intersections.tile_starts,
                  intersections.entries, images[view].transmittance, images[view].contributors, gradients[view].color,
                  gradients[view].alpha, slots);
  }
  return slots;
}

}  // namespace degas
