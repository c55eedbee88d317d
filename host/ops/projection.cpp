#include "host/ops/projection.h"

#include "host/ops/intersection.h"

namespace degas {
namespace {

/// The kernels' View, in their REAL.
template <typename Real>
struct View {
  Real rotation[9], translation[3];
  Real fx, fy, cx, cy;
  Real left, right, top, bottom;
  Real width, height, near_plane, blur;
};

template <typename Real>
View<Real> view_of(const Camera& camera, const SplatOptions& options) {
  View<Real> view;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      view.rotation[3 * row + column] = static_cast<Real>(camera.rotation(row, column));
    view.translation[row] = static_cast<Real>(camera.translation(row));
  }
  view.fx = static_cast<Real>(camera.fx);
  view.fy = static_cast<Real>(camera.fy);
  view.cx = static_cast<Real>(camera.cx);
  view.cy = static_cast<Real>(camera.cy);
  // The edges of the image, and 15 % of its size beyond: 1.3 times the frustum of a centred principal point.
  constexpr double beyond = 0.15;
  view.left = static_cast<Real>((-beyond * camera.width - camera.cx) / camera.fx);
  view.right = static_cast<Real>(((1 + beyond) * camera.width - camera.cx) / camera.fx);
  view.top = static_cast<Real>((-beyond * camera.height - camera.cy) / camera.fy);
  view.bottom = static_cast<Real>(((1 + beyond) * camera.height - camera.cy) / camera.fy);
  view.width = static_cast<Real>(camera.width);
  view.height = static_cast<Real>(camera.height);
  view.near_plane = static_cast<Real>(options.near_plane);
  view.blur = static_cast<Real>(options.blur);
  return view;
}

/// Queues a projection kernel with the view and the count as its last arguments.
template <typename... Arguments>
void launch(const char* name, const Splats& splats, const Camera& camera, const SplatOptions& options,
            const Arguments&... arguments) {
  Device& device = splats.positions.device();
  const int64_t count = splats.positions.dim(0);
  const Kernel kernel = device.kernel("projection", name, {{"ANTIALIAS", options.antialias ? 1 : 0}});
  const Range global = device.pointwise_global(count), local = {device.is_wide() ? size_t{16} : size_t{64}};
  if (device.real_bytes() == 8) {
    kernel.launch(global, local, arguments..., view_of<double>(camera, options), count);
  } else {
    kernel.launch(global, local, arguments..., view_of<float>(camera, options), count);
  }
}

}  // namespace

ProjectedSplats project_splats(const Splats& splats, const Camera& camera, const SplatOptions& options) {
  Device& device = splats.positions.device();
  const int64_t count = splats.positions.dim(0);
  const ProjectedSplats projected{Tensor(device, {count, 16}), Tensor(device, {count}, Element::UInt32)};
  launch("project_forward", splats, camera, options, splats.positions, splats.rotations, splats.log_scales,
         splats.opacities, splats.colors, projected.records, projected.depth_keys);
  return projected;
}

void project_splats_backward(const Splats& splats, const Intersections& intersections, const Tensor& slots,
                             const Camera& camera, const SplatOptions& options, const Splats& gradients) {
  launch("project_backward", splats, camera, options, splats.positions, splats.rotations, splats.log_scales,
         splats.opacities, intersections.slot_counts, intersections.slot_offsets, slots, gradients.positions,
         gradients.rotations, gradients.log_scales, gradients.opacities, gradients.colors);
}

}  // namespace degas
