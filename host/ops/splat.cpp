#include "host/ops/splat.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "host/ops/harmonics.h"
#include "host/ops/intersection.h"
#include "host/ops/projection.h"
#include "host/ops/raster.h"

namespace degas {
namespace {

void require_shape(const char* name, const Tensor& tensor, const Shape& expected) {
  if (tensor.shape() != expected) {
    throw std::logic_error(
        fmt::format("[splat] {} has shape {}, expected {}", name, to_string(tensor.shape()), to_string(expected)));
  }
}

void require_fitting(const Splats& splats, const std::vector<SplatView>& views) {
  const int64_t count = splats.positions.dim(0);
  require_shape("positions", splats.positions, {count, 3});
  require_shape("rotations", splats.rotations, {count, 4});
  require_shape("log_scales", splats.log_scales, {count, 3});
  require_shape("opacities", splats.opacities, {count});
  require_shape("colors", splats.colors, {count, 3});
  if (views.empty()) throw std::logic_error("[splat] no view to draw");
  for (const auto& [camera, background] : views) {
    if (camera.width <= 0 || camera.height <= 0) {
      throw std::logic_error(fmt::format("[splat] image size {}x{}", camera.width, camera.height));
    }
  }
}

/// The gradient tensor of a field, or an undefined one where none is wanted.
Tensor wanted_gradient(const Tensor& field) {
  return field.requires_gradient() ? Tensor(field.device(), field.shape()) : Tensor();
}

}  // namespace

int64_t SplatWorkspace::reserve(int64_t intersections) {
  if (intersections > capacity_) capacity_ = std::max<int64_t>(intersections + intersections / 2, 4096);
  return capacity_;
}

std::vector<SplatImage> splat(Tape& tape, SplatWorkspace& workspace, const Splats& given,
                              const std::vector<SplatView>& given_views, const SplatOptions& options) {
  require_fitting(given, given_views);
  Splats splats = given;
  if (given.harmonics.defined()) {
    std::vector<Eigen::Vector3d> centers;
    for (const SplatView& view : given_views) centers.push_back(view.camera.center());
    splats.colors = colors_seen_from(tape, centers, given.positions, given.rotations, given.colors, given.harmonics,
                                     workspace.reserve_views(static_cast<int64_t>(given_views.size())));
  }
  const SplatViews views = upload_views(tape.device(), given_views, options);
  const ProjectedSplats projected = project_splats(workspace, splats, views, options);
  const Intersections intersections = intersect_tiles(workspace, projected, views);
  const std::vector<RasterImage> drawn = rasterize(projected, intersections, views, options);
  std::vector<SplatImage> images;
  std::vector<Tensor> outputs;
  for (const RasterImage& image : drawn) {
    images.push_back({image.color, image.alpha});
    outputs.insert(outputs.end(), {image.color, image.alpha});
  }
  // Of what the way back does not read it keeps no values.
  std::vector<RasterImage> kept = drawn;
  for (RasterImage& image : kept) {
    image.color = image.color.without_values();
    image.alpha = image.alpha.without_values();
  }
  const ProjectedSplats kept_splats{projected.count, projected.records, {}, {}};
  tape.record("splat", {splats.positions, splats.rotations, splats.log_scales, splats.opacities, splats.colors},
              outputs, [splats, views, intersections, kept, kept_splats, options](Tape& tape) {
                std::vector<RasterGradient> wanted;
                for (const RasterImage& image : kept) {
                  wanted.push_back({tape.gradient_or_zeros(image.color), tape.gradient_or_zeros(image.alpha)});
                }
                const Tensor slots = rasterize_backward(kept_splats, intersections, kept, wanted, views, options);
                const Splats gradients{wanted_gradient(splats.positions),  wanted_gradient(splats.rotations),
                                       wanted_gradient(splats.log_scales), wanted_gradient(splats.opacities),
                                       wanted_gradient(splats.colors),     {}};
                project_splats_backward(splats, intersections, slots, views, options, gradients);
                tape.accumulate(splats.positions, gradients.positions);
                tape.accumulate(splats.rotations, gradients.rotations);
                tape.accumulate(splats.log_scales, gradients.log_scales);
                tape.accumulate(splats.opacities, gradients.opacities);
                tape.accumulate(splats.colors, gradients.colors);
              });
  return images;
}

SplatImage splat(Tape& tape, SplatWorkspace& workspace, const Splats& splats, const Camera& camera,
                 const std::array<double, 3>& background, const SplatOptions& options) {
  return splat(tape, workspace, splats, {{camera, background}}, options).front();
}

}  // namespace degas
