#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/ops/drift.h"
#include "host/ops/image.h"
#include "host/ops/lpips.h"
#include "model/config.h"

namespace degas {

/// A rendered picture beside its photograph, both (H,W,3) over the same background.
struct LossView {
  Tensor image, target;
  /// What the perceptual term sees where loss.lpips_region is person or face, in pixels of the picture; it may reach
  /// outside. Absent: the whole picture for person, no perceptual term for face.
  std::optional<Rectangle> region;
  std::array<double, 3> background = {0, 0, 0};
};

/// What the regularisers act on.
struct LossMaps {
  Tensor position_offsets;  ///< (N,3) the position head at the Gaussians, d_mu
  Tensor log_scales;        ///< (N,3)
  Tensor opacity_logits;    ///< (N)
  Tensor divergence;        ///< (1) of the latent from a unit Gaussian; undefined where net.kl_weight is 0
};

/// The loss of one step and what it is made of: each of shape (1), unweighted means over the views.
struct LossTerms {
  Tensor total;
  /// l1_ssim, lpips (in steps that have it), offset, scale, drift, collapse and kl (where weighted).
  std::map<std::string, Tensor> terms;

  /// The terms and "loss", the total, as numbers. Waits for the device: for logging.
  std::map<std::string, double> values() const;
};

/// (1 - w) L1 + w (1 - SSIM) + LPIPS + mean |d_mu| + L_d + L_s + L_c + KL, weighted as the config says (method.md,
/// "Loss, optimiser, schedule"). Two are this project's own. L_d, "drift", is how far the Gaussians of each part of the
/// body have moved off it as a whole: poses that are refined together and offsets can both do that, so that pictures do
/// not tell, but a novel sequence has the poses as registered. L_c, "collapse", is the mean shortfall of opacity logits
/// below that of loss.opacity_floor, and of log-scales below loss.scale_floor times their base. Pictures have no say
/// beyond: what is fainter than 1/255 is not drawn, and of what is far below a pixel only the blur shows, so that a
/// step too far (L_s does that to scales that have exploded) would be for good. Decides and adds on the device.
class Loss {
 public:
  /// Reads config.loss, net.kl_weight and train.gradient_clip.offset_limit (a step whose mean |d_mu| exceeds it has the
  /// offset term alone; 0: never). base_log_scales: (N,3); parts: of N Gaussians. Throws Error when loss.lpips_weight >
  /// 0 and there are no weights (lpips_weights.h).
  Loss(Device& device, const Config& config, const Tensor& base_log_scales, RowGroups parts);

  /// step: counts from 0; every lpips_every-th has the perceptual term, its weight grown as much.
  LossTerms evaluate(Tape& tape, const std::vector<LossView>& views, const LossMaps& maps, int64_t step) const;

 private:
  /// Undefined when the view has no region that counts.
  Tensor perceptual(Tape& tape, const LossView& view) const;

  LossConfig config_;
  double kl_weight_, offset_limit_;
  Tensor base_log_scales_;
  RowGroups parts_;
  std::optional<Lpips> lpips_;
};

}  // namespace degas
