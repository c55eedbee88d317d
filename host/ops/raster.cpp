#include "host/ops/raster.h"

namespace degas {
namespace {

template <typename... Arguments>
void launch(const char* name, const Intersections& intersections, const SplatOptions& options,
            const Arguments&... arguments) {
  Device& device = intersections.tile_starts.device();
  Defines defines = {{"TILE_HEIGHT", splat_tile_height}, {"SMOOTH_CUTOFF", options.smooth_cutoff ? 1 : 0}};
  const auto columns = static_cast<size_t>(intersections.columns), rows = static_cast<size_t>(intersections.rows);
  if (device.is_wide()) {
    device.kernel("raster_wide", name, defines).launch({columns * rows}, {1}, arguments...);
    return;
  }
  defines.emplace_back("TILE_WIDTH", splat_tile_width);
  // Eight splats a backward round take 29 KB of local memory in float; half as many keep double at 41 KB.
  defines.emplace_back("BATCH", device.real_bytes() == 8 ? 4 : 8);
  device.kernel("raster_gpu", name, defines)
      .launch({columns * splat_tile_width, rows * splat_tile_height}, {splat_tile_width, splat_tile_height},
              arguments...);
}

}  // namespace

RasterImage rasterize(const ProjectedSplats& projected, const Intersections& intersections, const Camera& camera,
                      const std::array<double, 3>& background, const SplatOptions& options) {
  Device& device = projected.records.device();
  const Shape pixels = {camera.height, camera.width};
  const RasterImage image{Tensor(device, {camera.height, camera.width, 3}), Tensor(device, pixels),
                          Tensor(device, pixels), Tensor(device, pixels, Element::Int32)};
  launch("raster_forward", intersections, options, projected.records, intersections.tile_starts, intersections.order,
         intersections.slot_splats, image.color, image.alpha, image.transmittance, image.contributors, background[0],
         background[1], background[2], camera.width, camera.height);
  return image;
}

Tensor rasterize_backward(const ProjectedSplats& projected, const Intersections& intersections,
                          const RasterImage& image, const Tensor& color_gradient, const Tensor& alpha_gradient,
                          const Camera& camera, const std::array<double, 3>& background, const SplatOptions& options) {
  const Tensor slots(projected.records.device(), {intersections.order.size(), 16});
  launch("raster_backward", intersections, options, projected.records, intersections.tile_starts, intersections.order,
         intersections.slot_splats, image.transmittance, image.contributors, color_gradient, alpha_gradient, slots,
         background[0], background[1], background[2], camera.width, camera.height);
  return slots;
}

}  // namespace degas
