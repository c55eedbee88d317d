#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// (1 - ssim_weight) * mean |image - target| + ssim_weight * (1 - SSIM): shape (1). image, target: (H,W,3), range 0..1.
/// SSIM (Wang et al. 2004): 11x11 Gaussian window of sigma 1.5, zero padding outside the image, mean over all pixels
/// and channels. Value and gradient are fused; the gradient goes to image only.
Tensor l1_ssim_loss(Tape& tape, const Tensor& image, const Tensor& target, double ssim_weight);

/// SSIM as a measure: the same window over the pixels that it covers whole ('valid', as scikit-image with
/// gaussian_weights and use_sample_covariance=False), mean over them: shape (1), no gradient. Needs sides of at
/// least 11.
Tensor ssim(const Tensor& image, const Tensor& target);

}  // namespace degas
