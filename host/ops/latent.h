#pragma once

#include "host/autograd/tape.h"

namespace degas {

/// mean + exp(log_deviation) * noise, elementwise: a draw from the encoder's Gaussian (Kingma and Welling 2014; the
/// method calls log_deviation the log-variance). noise gets no gradient.
Tensor sample_latent(Tape& tape, const Tensor& mean, const Tensor& log_deviation, const Tensor& noise);

/// Elementwise divergence of that Gaussian from the unit one: (mean^2 + deviation^2 - 1) / 2 - log_deviation.
Tensor unit_divergence(Tape& tape, const Tensor& mean, const Tensor& log_deviation);

}  // namespace degas
