// What the kernels of Gaussian splatting share: the constants of blending, the record of a projected splat,
// exponentials. Needs common/real.cl before it.

// A splat's alpha in a pixel is cut off below ALPHA_MIN and clamped to ALPHA_MAX; a pixel takes no further splats once
// its transmittance is below TRANSMITTANCE_MIN. Forward and backward read the same three constants.
#define ALPHA_MIN ((REAL)(1.0 / 255.0))
#define ALPHA_MAX ((REAL)0.99)
#define TRANSMITTANCE_MIN ((REAL)1e-4)
#define LOG2_ALPHA_MIN ((REAL)-7.99435343685885794)
#define LOG2_E ((REAL)1.44269504088896341)

// Record of a projected splat, RECORD_SIZE REALs (one cache line of floats). With d = pixel centre - (u, v):
//   log2(alpha) = LOG2_OPACITY - s^2 - t^2, s = SHARPNESS_X (d.x - SLOPE d.y), t = SHARPNESS_Y d.y,
// the Gaussian factored into its row's conditional Gaussian times the marginal of y: a sum of squares, never positive.
// WIDTH and HEIGHT are half the box of alpha >= ALPHA_MIN; TILT is d.y where its right-most point lies.
// A block of 4x4 pixels whose centre lies at (s, t) has a pixel of alpha >= ALPHA_MIN only if |s| <= BLOCK_REACH and
// s^2 + t^2 <= BLOCK_RADIUS^2. WIDTH < 0 marks a culled splat, whose other fields mean nothing.
#define RECORD_SIZE 16
#define RECORD_U 0
#define RECORD_V 1
#define RECORD_SHARPNESS_X 2
#define RECORD_SLOPE 3
#define RECORD_SHARPNESS_Y 4
#define RECORD_LOG2_OPACITY 5
#define RECORD_WIDTH 6
#define RECORD_HEIGHT 7
#define RECORD_TILT 8
#define RECORD_COLOR 9
#define RECORD_BLOCK_REACH 12
#define RECORD_BLOCK_RADIUS 13
#define RECORD_USED 14

// Gradient slot of a (tile, splat) intersection, SLOT_SIZE REALs, and of a splat once its slots are summed. With
// w = dL / d ln(alpha) of a pixel, summed over pixels: w, w s, w t, w s^2, w s t, w t^2, then dL / d colour.
#define SLOT_SIZE 16
#define SLOT_USED 9

#define AS_REALV JOIN(as_, REALV)
#define AS_INTV JOIN(as_, INTV)

// 2^p for |p| < 126; relative error below 1e-7 in float (degree 6 on [-0.5, 0.5], whose own is below 4e-9: that of a
// lower degree is alike in neighbouring pixels, so that sums keep it). Garbage, not a trap, outside.
inline REALV exp2_in_range(const REALV p) {
#if REAL_IS_DOUBLE
  return exp2(p);
#else
  // Adding 1.5 * 2^23 leaves the nearest integer in the low bits of the sum.
  const REALV shifted = p + 12582912.0f;
  const REALV f = p - (shifted - 12582912.0f);
  REALV r = f * 1.53243120e-4f + 1.33909588e-3f;
  r = r * f + 9.61851794e-3f;
  r = r * f + 5.55035956e-2f;
  r = r * f + 2.40226477e-1f;
  r = r * f + 6.93147182e-1f;
  r = r * f + 1.0f;
  return AS_REALV(AS_INTV(r) + (AS_INTV(shifted) << 23));
#endif
}

// e^x with x clamped to [-87, 88].
inline REALV exp_clamped(const REALV x) {
#if REAL_IS_DOUBLE
  return exp(x);
#else
  const REALV c = fmin(fmax(x, -87.0f), 88.0f);
  const REALV shifted = c * LOG2_E + 12582912.0f;
  const REALV n = shifted - 12582912.0f;
  const REALV f = ((c - n * 0.693359375f) - n * -2.12194440e-4f) * LOG2_E;
  return exp2_in_range(f) * AS_REALV((AS_INTV(shifted) + 127) << 23);
#endif
}
