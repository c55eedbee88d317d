// Winograd's minimal filtering F(4x4, 3x3) (Lavin and Gray 2016): 4 x 4 target pixels from 6 x 6 source pixels by 36
// products instead of 144. With a = 1/sqrt(2), b = sqrt(2) and the points 0, a, -a, b, -b and infinity its rounding
// error is within twice that of the plain sum, thrice in the gradient of the weights; the points 0, 1, -1, 2, -2 of
// textbooks lose four times as much.
#include "common/prefetch.cl"
#include "common/real.cl"

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

// The transposes of the last two: for the gradient with respect to the weights.
inline void target_to_points(const REALV y[4], REALV point[6]) {
  const REALV even_a = fma((REALV)(0.5), y[2], y[0]), odd_a = fma((REALV)(0.5), y[3], y[1]);
  const REALV even_b = fma((REALV)(2), y[2], y[0]), odd_b = fma((REALV)(2), y[3], y[1]);
  point[0] = y[0];
  point[1] = fma((REALV)(ROOT_HALF), odd_a, even_a);
  point[2] = fma((REALV)(-ROOT_HALF), odd_a, even_a);
  point[3] = fma((REALV)(ROOT_TWO), odd_b, even_b);
  point[4] = fma((REALV)(-ROOT_TWO), odd_b, even_b);
  point[5] = y[3];
}

inline void points_to_taps(const REALV point[6], REALV w[3]) {
  const REALV even_a = (point[1] + point[2]) * (REAL)(-2.0 / 3), odd_a = (point[1] - point[2]) * (REAL)(-2.0 / 3);
  const REALV even_b = (point[3] + point[4]) * (REAL)(1.0 / 6), odd_b = (point[3] - point[4]) * (REAL)(1.0 / 6);
  w[0] = point[0] + even_a + even_b;
  w[1] = fma((REALV)(ROOT_HALF), odd_a, ROOT_TWO * odd_b);
  w[2] = fma((REALV)(0.5), even_a, fma((REALV)(2), even_b, point[5]));
}

// An image's sizes; channels of all groups.
typedef struct {
  int height, width, channels;
} Plane;

// The 6 x 6 patch of a source plane at y, x, `depth` channels (a multiple of V): its points of the lines first_line ..
// first_line + lines - 1 of the six to to[point * stride + channel]. Pixels outside of the plane are zeros; inside:
// there are none, known when compiled, as `lines` is.
__attribute__((always_inline)) inline void patch_to_points(global const REAL* source, const Plane plane, const int y,
                                                           const int x, const bool inside, const int depth,
                                                           const int first_line, const int lines, local REAL* to,
                                                           const int stride) {
  const long pitch = (long)plane.width * plane.channels;
  global const REAL* const corner = source + y * pitch + (long)x * plane.channels;
  for (int k = 0; k < depth; k += V) {
    REALV column[6][6];  // points along y, by the pixel's x
#pragma unroll
    for (int dx = 0; dx < 6; ++dx) {
      REALV d[6], point[6];
#pragma unroll
      for (int dy = 0; dy < 6; ++dy) {
        d[dy] = 0;
        if (inside || ((uint)(y + dy) < (uint)plane.height && (uint)(x + dx) < (uint)plane.width))
          d[dy] = LOAD_VECTOR(0, corner + dy * pitch + dx * plane.channels + k);
      }
      source_to_points(d, point);
#pragma unroll
      for (int i = 0; i < lines; ++i) column[i][dx] = point[first_line + i];
    }
#pragma unroll
    for (int i = 0; i < lines; ++i) {
      REALV point[6];
      source_to_points(column[i], point);
#pragma unroll
      for (int j = 0; j < 6; ++j) STORE_VECTOR(point[j], 0, to + (i * 6 + j) * stride + k);
    }
  }
}

inline bool patch_is_inside(const Plane plane, const int y, const int x) {
  return y >= 0 && x >= 0 && y + WINOGRAD_PATCH <= plane.height && x + WINOGRAD_PATCH <= plane.width;
}

// Hints of what the patch at y, x does not share with its left neighbour.
inline void prefetch_patch(global const REAL* source, const Plane plane, const int y, const int x, const int depth) {
  global const REAL* const corner = source + ((long)y * plane.width + x + 2) * plane.channels;
  for (int dy = 0; dy < WINOGRAD_PATCH; ++dy) {
    for (int dx = 0; dx < WINOGRAD_TILE; ++dx) {
      for (int k = 0; k < depth; k += CACHE_LINE) PREFETCH(corner + ((long)dy * plane.width + dx) * plane.channels + k);
    }
  }
}
