#pragma once

#include "host/ops/intersection.h"

namespace degas {

/// A drawn image and what its backward pass needs.
struct RasterImage {
  Tensor color, alpha;   ///< (H,W,3), (H,W)
  Tensor transmittance;  ///< (H,W): behind the last contributor
  Tensor contributors;   ///< Int32 (H,W): place in Intersections::order of the last contributor, plus one
};

/// kernels/raster_wide.cl and raster_gpu.cl: composites each tile's splats front to back over the background.
RasterImage rasterize(const ProjectedSplats& projected, const Intersections& intersections, const Camera& camera,
                      const std::array<double, 3>& background, const SplatOptions& options);

/// Gradient slots (capacity,16), layout in kernels/common/splat.cl; written for the intersections that exist.
Tensor rasterize_backward(const ProjectedSplats& projected, const Intersections& intersections,
                          const RasterImage& image, const Tensor& color_gradient, const Tensor& alpha_gradient,
                          const Camera& camera, const std::array<double, 3>& background, const SplatOptions& options);

}  // namespace degas
