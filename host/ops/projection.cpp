#include "host/ops/projection.h"

#include "host/ops/intersection.h"

namespace degas {
namespace {

/// Queues a projection kernel with the views and counts as its last arguments.
template <typename... Arguments>
void launch_projection(const char* name, int64_t items, const Splats& splats, const SplatViews& views,
                       const SplatOptions& options, const Arguments&... arguments) {
  Device& device = splats.positions.device();
  const int colors_by_view = splats.colors.shape().size() == 3;
  device
      .kernel("projection", name,
              {{"ANTIALIAS", options.antialias ? 1 : 0},
               {"TILE_WIDTH", splat_tile_width},
               {"TILE_HEIGHT", splat_tile_height}})
      .launch({static_cast<size_t>(items)}, {device.is_wide() ? size_t{16} : size_t{64}}, arguments..., views.on_device,
              static_cast<int>(views.count()), colors_by_view, splats.positions.dim(0));
}

}  // namespace

ProjectedSplats project_splats(SplatWorkspace& workspace, const Splats& splats, const SplatViews& views,
                               const SplatOptions& options) {
  Device& device = splats.positions.device();
  const int64_t count = splats.positions.dim(0), room = workspace.reserve_projections(count * views.count());
  const ProjectedSplats projected{count * views.count(), Tensor(device, {room, 16}),
                                  Tensor(device, {room}, Element::UInt32),
                                  device.is_wide() ? Tensor(device, {room, 4}, Element::UInt32) : Tensor()};
  const int64_t items = static_cast<int64_t>(device.pointwise_global(count)[0]) * views.count();
  launch_projection("project_forward", items, splats, views, options, splats.positions, splats.rotations,
                    splats.log_scales, splats.opacities, splats.colors, projected.records, projected.depth_keys,
                    projected.tile_boxes);
  return projected;
}

void project_splats_backward(const Splats& splats, const Intersections& intersections, const Tensor& slots,
                             const SplatViews& views, const SplatOptions& options, const Splats& gradients) {
  const auto items = static_cast<int64_t>(slots.device().pointwise_global(splats.positions.dim(0))[0]);
  launch_projection("project_backward", items, splats, views, options, splats.positions, splats.rotations,
                    splats.log_scales, splats.opacities, intersections.slots_of, slots, gradients.positions,
                    gradients.rotations, gradients.log_scales, gradients.opacities, gradients.colors);
}

}  // namespace degas
