// What the kernels of L1 and structural dissimilarity share. Needs common/real.cl before it. Two (H,W,C) images in one
// pass, and their gradient in a second:
//   partial = l1_factor * sum |d| + ssim_factor * sum (1 - SSIM),   d = image - target
//   gradient = l1_factor * sign(d) + ssim_factor * d sum (1 - SSIM) / d image
// SSIM after Wang et al. 2004 with an 11x11 Gaussian window of sigma 1.5, C1 = 0.01^2, C2 = 0.03^2 (range 1), zero
// padding outside the image ('same' size, as 3DGS codes do). With window means m and E[.], it is evaluated in the equal
// form
//   1 - SSIM = a + b - a b,   a = m_d^2 / (m_x^2 + m_y^2 + C1),   b = V_d / (V_x + V_y + C2),
//   V_d = E[d^2] - m_d^2 and V_x + V_y = E[x^2 + y^2] - m_x^2 - m_y^2, both clamped at 0,
// so rounding can never lift SSIM above 1 and nearly equal images keep their digits. Four blurs forward (x, d, d^2,
// x^2 + y^2), three backward (derivatives by m_x, E[d^2], E[x^2 + y^2]).
// Background is skipped: where d is 0 all over a window, 1 - SSIM and its derivatives are 0, but for that by E[d^2],
// which is only ever multiplied by d of places in the window and so may be 0 as well. Comparisons are all that such
// places cost; the results are the same.
// Arrays: image, target, gradient (H, row_length), row_length = W * CHANNELS. derivative (3, H, pitch): pitch is a
// multiple of V, columns past row_length are written as zeros; null when no gradient is wanted. `margin` pixels at each
// border are left out of the sums (the gradient kernel knows margin 0 only).

#define RADIUS 5
#define TAPS 11
#define C1 ((REAL)1e-4)
#define C2 ((REAL)9e-4)
// exp(-k^2 / (2 * 1.5^2)), k = -5..5, normalised to sum 1.
constant REAL window[TAPS] = {
    (REAL)0.001028380084479110, (REAL)0.007598758135239185, (REAL)0.036000772128430829, (REAL)0.109360689509700015,
    (REAL)0.213005537711253690, (REAL)0.266011724861794363, (REAL)0.213005537711253690, (REAL)0.109360689509700015,
    (REAL)0.036000772128430829, (REAL)0.007598758135239185, (REAL)0.001028380084479110};

// 1 - SSIM of V window positions, and its derivatives by m_x, E[d^2] and E[x^2 + y^2].
REALV dissimilarity(const REALV mean_x, const REALV mean_d, const REALV square_d, const REALV square_sum,
                    REALV* by_mean, REALV* by_square_d, REALV* by_square_sum) {
  const REALV mean_y = mean_x - mean_d;
  const REALV means = mean_x * mean_x + mean_y * mean_y;
  const REALV variance_d = max(square_d - mean_d * mean_d, (REAL)0);
  const REALV inverse1 = 1 / (means + C1);
  const REALV inverse2 = 1 / (max(square_sum - means, (REAL)0) + C2);
  const REALV a = mean_d * mean_d * inverse1;
  const REALV b = variance_d * inverse2;
  *by_square_d = (1 - a) * inverse2;
  *by_square_sum = (a - 1) * b * inverse2;
  *by_mean = 2 * ((1 - b) * inverse1 * (mean_d - a * mean_x) + (1 - a) * inverse2 * (b * mean_x - mean_d));
  return a + b - a * b;
}
