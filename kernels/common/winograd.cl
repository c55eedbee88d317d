// Winograd's minimal filtering F(4x4, 3x3) (Lavin and Gray 2016): 4 x 4 target pixels from 6 x 6 source pixels by 36
// products instead of 144. With a = 1/sqrt(2), b = sqrt(2) and the points 0, a, -a, b, -b and infinity its rounding
// error is within twice that of the plain sum; the textbook's points 0, 1, -1, 2, -2 lose four times as much.
#define WINOGRAD_TILE 4    // target pixels on a side
#define WINOGRAD_PATCH 6   // source pixels on a side, and points
#define WINOGRAD_POINTS 36
#define ROOT_HALF ((REAL)0.70710678118654752440)
#define ROOT_TWO ((REAL)1.41421356237309504880)

// One axis of the source: from six neighbouring values to six points.
inline void source_to_points(const REALV d[6], REALV point[6]) {
  const REALV even_a = fma((REALV)(-2), d[2], d[4]), odd_a = fma((REALV)(-2), d[1], d[3]);
  const REALV even_b = fma((REALV)(-0.5), d[2], d[4]), odd_b = fma((REALV)(-0.5), d[1], d[3]);
  point[0] = fma((REALV)(-2.5), d[2], d[0] + d[4]);
  point[1] = fma((REALV)(ROOT_HALF), odd_a, even_a);
  point[2] = fma((REALV)(-ROOT_HALF), odd_a, even_a);
  point[3] = fma((REALV)(ROOT_TWO), odd_b, even_b);
  point[4] = fma((REALV)(-ROOT_TWO), odd_b, even_b);
  point[5] = fma((REALV)(-2.5), d[3], d[1] + d[5]);
}

// One axis of the kernel: from three taps to six points.
inline void taps_to_points(const REALV w[3], REALV point[6]) {
  const REALV even_a = fma((REALV)(0.5), w[2], w[0]) * (REAL)(-2.0 / 3), odd_a = w[1] * (REAL)(-2.0 / 3) * ROOT_HALF;
  const REALV even_b = fma((REALV)(2), w[2], w[0]) * (REAL)(1.0 / 6), odd_b = w[1] * (REAL)(1.0 / 6) * ROOT_TWO;
  point[0] = w[0];
  point[1] = even_a + odd_a;
  point[2] = even_a - odd_a;
  point[3] = even_b + odd_b;
  point[4] = even_b - odd_b;
  point[5] = w[2];
}

// One axis of the target: from six points to four neighbouring values.
inline void points_to_target(const REALV point[6], REALV y[4]) {
  const REALV sum_a = point[1] + point[2], difference_a = (point[1] - point[2]) * ROOT_HALF;
  const REALV sum_b = point[3] + point[4], difference_b = (point[3] - point[4]) * ROOT_TWO;
  y[0] = point[0] + sum_a + sum_b;
  y[1] = difference_a + difference_b;
  y[2] = fma((REALV)(2), sum_b, (REAL)0.5 * sum_a);
  y[3] = fma((REALV)(2), difference_b, fma((REALV)(0.5), difference_a, point[5]));
}
