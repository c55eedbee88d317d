#include "host/ops/splat_views.h"

#include <Eigen/LU>
#include <cmath>

namespace degas {
namespace {

/// The kernels' View, in their REAL.
template <typename Real>
struct View {
  Real rotation[9];
  Real center_whole[3], center_rest[3];
  Real fx, fy, cx, cy;
  Real left, right, top, bottom;
  Real near_plane, blur;
  int32_t width, height, grid_columns, first_tile;
};

template <typename Real>
View<Real> view_of(const Camera& camera, const SplatOptions& options) {
  View<Real> view;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      view.rotation[3 * row + column] = static_cast<Real>(camera.rotation(row, column));
  }
  // Not camera.center(): calibrations are rotations only up to their digits.
  const Eigen::Vector3d center = -camera.rotation.inverse() * camera.translation;
  for (int c = 0; c < 3; ++c) {
    const double whole = std::round(center[c]);
    view.center_whole[c] = static_cast<Real>(whole);
    view.center_rest[c] = static_cast<Real>(center[c] - whole);
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
  view.near_plane = static_cast<Real>(options.near_plane);
  view.blur = static_cast<Real>(options.blur);
  view.width = camera.width;
  view.height = camera.height;
  return view;
}

template <typename Real>
Tensor upload(Device& device, const SplatViews& views, const SplatOptions& options) {
  std::vector<View<Real>> all;
  for (int64_t k = 0; k < views.count(); ++k) {
    all.push_back(view_of<Real>(views.views[k].camera, options));
    all.back().grid_columns = views.columns(k);
    all.back().first_tile = views.first_tiles[k];
  }
  // Room for some more, so that the size is mostly the same.
  all.resize((all.size() + 7) / 8 * 8);
  const auto bytes = static_cast<int64_t>(all.size() * sizeof(View<Real>));
  return Tensor::from(device, {bytes}, std::span(reinterpret_cast<const uint8_t*>(all.data()), bytes));
}

}  // namespace

SplatViews upload_views(Device& device, std::vector<SplatView> views, const SplatOptions& options) {
  SplatViews result{std::move(views), {}, {0}};
  for (int64_t k = 0; k < result.count(); ++k) {
    result.first_tiles.push_back(result.tiles() + result.columns(k) * result.rows(k));
  }
  result.on_device =
      device.real_bytes() == 8 ? upload<double>(device, result, options) : upload<float>(device, result, options);
  return result;
}

}  // namespace degas
