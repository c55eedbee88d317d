#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "host/autograd/tape.h"
#include "host/ops/camera.h"

namespace degas {

/// Splats that are fainter, or a log-scale of which is beyond +-largest_log_scale, are drawn nowhere (ALPHA_MIN of
/// kernels/common/splat.cl, LOG_SCALE_MAX of kernels/projection.cl).
constexpr double faintest_opacity = 1.0 / 255, largest_log_scale = 80;

/// N anisotropic 3D Gaussians. A splat with a non-finite number, a quaternion of norm below 1e-3, a log-scale beyond
/// +-80 or an opacity outside [1/255, 1] is not drawn and receives zero gradients.
struct Splats {
  Tensor positions;   ///< (N,3) metres, world
  Tensor rotations;   ///< (N,4) quaternions w,x,y,z of any norm
  Tensor log_scales;  ///< (N,3) ln of the standard deviations in metres
  Tensor opacities;   ///< (N) 0..1
  Tensor colors;      ///< (N,3)
  Tensor harmonics;   ///< (N,K,3) of colors_seen_from, or undefined: the same colour from everywhere
};

struct SplatOptions {
  bool antialias = false;      ///< scale opacity by sqrt(det(cov) / det(cov + blur)), at least 0.005 (Mip-Splatting)
  double near_plane = 0.05;    ///< metres; splats nearer than this are culled
  double blur = 0.3;           ///< px^2 added to the covariance's diagonal
  bool smooth_cutoff = false;  ///< for finite differences: alpha fades in over [1/255, 2/255] instead of stepping
};

struct SplatImage {
  Tensor color;  ///< (H,W,3), over the background
  Tensor alpha;  ///< (H,W), accumulated
};

struct SplatView {
  Camera camera;
  std::array<double, 3> background = {0, 0, 0};
};

/// What is kept from view to view: room for the intersections of splats and tiles. It grows by half more than needed,
/// so that training allocates nothing once the largest view has been near. One per trainer; any number of tapes may use
/// it.
class SplatWorkspace {
 public:
  int64_t capacity() const { return capacity_; }
  /// At least `intersections`, rounded up generously; never shrinks.
  int64_t reserve(int64_t intersections);
  /// The most ever asked for: fewer views at once, as validation draws them, then find memory of the sizes they use.
  int64_t reserve_views(int64_t count) { return views_ = std::max(views_, count); }
  int64_t reserve_projections(int64_t count) { return projections_ = std::max(projections_, count); }
  int64_t reserve_tiles(int64_t count) { return tiles_ = std::max(tiles_, count); }

 private:
  int64_t capacity_ = 0, views_ = 0, projections_ = 0, tiles_ = 0;
};

/// Draws the splats front to back in the order (depth, index) by EWA splatting (Zwicker et al. 2001; Kerbl et al.
/// 2023): alpha = min(0.99, opacity exp(-d^T C^-1 d / 2)), nothing below 1/255, nothing behind a transmittance of 1e-4.
/// The Jacobian of the perspective is taken at x/z and y/z clamped to the image's edges plus 15 % of its size; splats
/// whose centre lies beyond are drawn about their true centre with the shape, and so the long axis, of the clamped
/// place: exact for an axis parallel to the image; one that also runs in depth turns towards what it would be at the
/// limit. Gradients go to every field of `splats` that requires one, bit-reproducibly. An image a view; views drawn
/// together cost fewer launches, and one read-back of some bytes (the number of intersections, to size what follows).
/// Throws Error when the views have more than 2^31 - 1 intersections in all.
std::vector<SplatImage> splat(Tape& tape, SplatWorkspace& workspace, const Splats& splats,
                              const std::vector<SplatView>& views, const SplatOptions& options = {});
/// The same of one view.
SplatImage splat(Tape& tape, SplatWorkspace& workspace, const Splats& splats, const Camera& camera,
                 const std::array<double, 3>& background, const SplatOptions& options = {});

}  // namespace degas
