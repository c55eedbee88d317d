// The latent code of a variational auto-encoder, whose spread is exp(log_deviation): sampling and its divergence from a
// unit Gaussian. Launch: one item per element; codes are short (about a thousand numbers), so plain scalar code serves.
// Deterministic: no element is written twice.
#include "common/real.cl"

// code = mean + exp(log_deviation) * noise
kernel void sample_latent(global const REAL* mean, global const REAL* log_deviation, global const REAL* noise,
                          global REAL* code, const int count) {
  const int i = get_global_id(0);
  if (i >= count) return;
  code[i] = mean[i] + exp(log_deviation[i]) * noise[i];
}

// d code / d log_deviation
kernel void sample_latent_backward(global const REAL* log_deviation, global const REAL* noise,
                                   global const REAL* code_gradient, global REAL* gradient, const int count) {
  const int i = get_global_id(0);
  if (i >= count) return;
  gradient[i] = code_gradient[i] * exp(log_deviation[i]) * noise[i];
}

// divergence[i] = (mean^2 + deviation^2 - 1) / 2 - log_deviation
kernel void unit_divergence(global const REAL* mean, global const REAL* log_deviation, global REAL* divergence,
                            const int count) {
  const int i = get_global_id(0);
  if (i >= count) return;
  const REAL deviation = exp(log_deviation[i]);
  divergence[i] = (REAL)0.5 * (mean[i] * mean[i] + deviation * deviation - 1) - log_deviation[i];
}

kernel void unit_divergence_backward(global const REAL* log_deviation, global const REAL* divergence_gradient,
                                     global REAL* gradient, const int count) {
  const int i = get_global_id(0);
  if (i >= count) return;
  const REAL deviation = exp(log_deviation[i]);
  gradient[i] = divergence_gradient[i] * (deviation * deviation - 1);
}
