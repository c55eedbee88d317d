#pragma once

#include "host/ops/intersection.h"

namespace degas {

/// A drawn image and what its backward pass needs.
struct RasterImage {
  Tensor color, alpha;   ///< (H,W,3), (H,W)
  Tensor transmittance;  ///< (H,W): behind the last contributor
  Tensor contributors;   ///< Int32 (H,W): place in Intersections::entries of the last contributor, plus one
};

/// kernels/raster_wide.cl and raster_gpu.cl: composites each tile's splats front to back over the background. An image
/// a view.
std::vector<RasterImage> rasterize(const ProjectedSplats& projected, const Intersections& intersections,
                                   const SplatViews& views, const SplatOptions& options);

/// A view's gradients, as RasterImage's fields.
struct RasterGradient {
  Tensor color, alpha;
};

/// Gradient slots (capacity,16), layout in kernels/common/splat.cl; written for the intersections that exist.
Tensor rasterize_backward(const ProjectedSplats& projected, const Intersections& intersections,
                          const std::vector<RasterImage>& images, const std::vector<RasterGradient>& gradients,
                          const SplatViews& views, const SplatOptions& options);

}  // namespace degas
