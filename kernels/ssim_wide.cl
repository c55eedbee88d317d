// L1 and structural dissimilarity of two images (common/ssim.cl) for wide vectors: a work-item owns ROWS x STRIP
// vectors, blurs them vertically in registers and then horizontally from memory of its own.
// -D V=16; CHANNELS: interleaved channels, 1..3: five pixels fit the one vector on either side of a strip.
// Launch: (ceil(pitch / (STRIP V)), ceil(H / ROWS)), local (1, 1); one slot of `partial` each, row by row.
// Deterministic: every number is written once, sums have a fixed order.
#include "common/real.cl"
#include "common/ssim.cl"

#define ROWS 4
#define STRIP 16
// Columns (of vectors) blurred vertically: the strip and one vector on either side for the horizontal taps.
#define COLUMNS (STRIP + 2)

#define LANE_NUMBERS (REALV)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)

// V values of a row from `column`, a multiple of V, on; zeros outside 0 .. row_length.
REALV load_padded(global const REAL* image, const int row, const int column, const int height, const int row_length) {
  if (row < 0 || row >= height || column < 0 || column >= row_length) return 0;
  const int rest = row_length - column;
  global const REAL* values = image + (long)row * row_length + column;
  if (rest >= V) return LOAD_VECTOR(0, values);
  // Behind a row lie the next ones.
  if ((long)(height - row) * row_length - column >= V) {
    return LANE_NUMBERS < (REALV)rest ? LOAD_VECTOR(0, values) : (REALV)0;
  }
  REAL lanes[V];
  for (int lane = 0; lane < V; ++lane) lanes[lane] = lane < rest ? values[lane] : 0;
  return LOAD_VECTOR(0, lanes);
}

// Row i of the ROWS + TAPS - 1 about an item's goes into the blur of each of its rows whose window it lies in.
__attribute__((always_inline)) inline void add_row(REALV sums[ROWS], const REALV value, const int i) {
#pragma unroll
  for (int r = 0; r < ROWS; ++r) {
    if (i >= r && i - r < TAPS) sums[r] += window[i - r] * value;
  }
}

// Vertical blurs of the vectors at `column` that the forward pass needs; whole: nothing of them lies outside.
__attribute__((always_inline)) inline void blur_images(global const REAL* image, global const REAL* target,
                                                       const int first_row, const int column, const int height,
                                                       const int row_length, const int whole, REALV mean_x[ROWS],
                                                       REALV mean_d[ROWS], REALV square_d[ROWS],
                                                       REALV square_sum[ROWS]) {
  const long corner = (long)(first_row - RADIUS) * row_length + column;
#pragma unroll
  for (int r = 0; r < ROWS; ++r) mean_x[r] = mean_d[r] = square_d[r] = square_sum[r] = 0;
#pragma unroll
  for (int i = 0; i < ROWS + TAPS - 1; ++i) {
    const int row = first_row + i - RADIUS;
    const long at = corner + (long)i * row_length;
    const REALV x = whole ? LOAD_VECTOR(0, image + at) : load_padded(image, row, column, height, row_length);
    const REALV y = whole ? LOAD_VECTOR(0, target + at) : load_padded(target, row, column, height, row_length);
    const REALV d = x - y;
    add_row(mean_x, x, i);
    add_row(mean_d, d, i);
    add_row(square_d, d * d, i);
    add_row(square_sum, x * x + (x - d) * (x - d), i);
  }
}

// The same of a plane of derivatives; whole: no row lies outside.
__attribute__((always_inline)) inline void blur_plane(global const REAL* plane, const int first_row, const int height,
                                                      const int pitch, const int whole, REALV sums[ROWS]) {
  global const REAL* corner = plane + (long)(first_row - RADIUS) * pitch;
#pragma unroll
  for (int r = 0; r < ROWS; ++r) sums[r] = 0;
#pragma unroll
  for (int i = 0; i < ROWS + TAPS - 1; ++i) {
    const int row = first_row + i - RADIUS;
    if (whole || (row >= 0 && row < height)) add_row(sums, LOAD_VECTOR(0, corner + (long)i * pitch), i);
  }
}

// Whether the windows about an item's pixels in a column of the strip, or (reach 2) in one next to it, hold anything;
// holds: per column whether it does.
int any_near(const int* holds, const int column, const int reach) {
  int near = 0;
  for (int c = max(column - reach, 0); c <= min(column + reach, COLUMNS - 1); ++c) near |= holds[c];
  return near;
}

REALV blur_horizontally(const REALV* line, const int column) {
  const REAL* center = (const REAL*)(line + column);
  REALV sum = 0;
#pragma unroll
  for (int tap = 0; tap < TAPS; ++tap) sum += window[tap] * LOAD_VECTOR(0, center + (tap - RADIUS) * CHANNELS);
  return sum;
}

kernel void ssim_forward(global const REAL* image, global const REAL* target, global REAL* derivative,
                         global REAL* partial, const REAL l1_factor, const REAL ssim_factor, const int height,
                         const int row_length, const int pitch, const int margin) {
  const int strip = get_global_id(0), first_row = get_global_id(1) * ROWS;
  REALV mean_x[ROWS][COLUMNS], mean_d[ROWS][COLUMNS], square_d[ROWS][COLUMNS], square_sum[ROWS][COLUMNS];
  const int rows_whole = first_row >= RADIUS && first_row + ROWS + RADIUS <= height;
  int differs[COLUMNS];
  for (int column = 0; column < COLUMNS; ++column) {
    const int start = (strip * STRIP + column - 1) * V;
    differs[column] = 0;
    for (int row = first_row - RADIUS; row < first_row + ROWS + RADIUS && !differs[column]; ++row) {
      differs[column] = any(load_padded(image, row, start, height, row_length) !=
                            load_padded(target, row, start, height, row_length));
    }
  }
  for (int column = 0; column < COLUMNS; ++column) {
    if (!any_near(differs, column, 2)) continue;
    const int start = (strip * STRIP + column - 1) * V;
    REALV sums[4][ROWS];
    if (rows_whole && start >= 0 && start + V <= row_length) {
      blur_images(image, target, first_row, start, height, row_length, 1, sums[0], sums[1], sums[2], sums[3]);
    } else {
      blur_images(image, target, first_row, start, height, row_length, 0, sums[0], sums[1], sums[2], sums[3]);
    }
#pragma unroll
    for (int r = 0; r < ROWS; ++r) {
      mean_x[r][column] = sums[0][r];
      mean_d[r][column] = sums[1][r];
      square_d[r][column] = sums[2][r];
      square_sum[r][column] = sums[3][r];
    }
  }
  REALV total = 0;
  for (int r = 0; r < ROWS && first_row + r < height; ++r) {
    const int row = first_row + r;
    const REAL row_counts = row >= margin && row < height - margin ? 1 : 0;
    for (int column = 1; column <= STRIP; ++column) {
      const int start = (strip * STRIP + column - 1) * V;
      if (start >= row_length) break;
      REALV counts = 0, by_mean = 0, by_square_d = 0, by_square_sum = 0;
      if (any_near(differs, column, 1)) {
        const REALV position = LANE_NUMBERS + start;
        counts = row_counts * step((REALV)(margin * CHANNELS), position) *
                 step(position, (REALV)(row_length - margin * CHANNELS - 1));
        const REALV value =
            dissimilarity(blur_horizontally(mean_x[r], column), blur_horizontally(mean_d[r], column),
                          blur_horizontally(square_d[r], column), blur_horizontally(square_sum[r], column), &by_mean,
                          &by_square_d, &by_square_sum);
        const REALV d = load_padded(image, row, start, height, row_length) -
                        load_padded(target, row, start, height, row_length);
        total += counts * (l1_factor * fabs(d) + ssim_factor * value);
      }
      if (derivative) {
        global REAL* out = derivative + (long)row * pitch + start;
        const long plane = (long)height * pitch;
        STORE_VECTOR(counts * by_mean, 0, out);
        STORE_VECTOR(counts * by_square_d, 0, out + plane);
        STORE_VECTOR(counts * by_square_sum, 0, out + 2 * plane);
      }
    }
  }
  REAL lanes[V];
  STORE_VECTOR(total, 0, lanes);
  REAL sum = 0;
  for (int lane = 0; lane < V; ++lane) sum += lanes[lane];
  partial[get_global_id(1) * get_global_size(0) + strip] = sum;
}

kernel void ssim_backward(global const REAL* image, global const REAL* target, global const REAL* derivative,
                          global REAL* gradient, const REAL l1_factor, const REAL ssim_factor, const int height,
                          const int row_length, const int pitch) {
  const int strip = get_global_id(0), first_row = get_global_id(1) * ROWS;
  const int rows_whole = first_row >= RADIUS && first_row + ROWS + RADIUS <= height;
  const long plane = (long)height * pitch;
  REALV blurred[3][ROWS][COLUMNS];
  int holds[COLUMNS];
  for (int column = 0; column < COLUMNS; ++column) {
    const int start = (strip * STRIP + column - 1) * V;
    const int first = start >= 0 && start < pitch ? max(first_row - RADIUS, 0) : height;
    holds[column] = 0;
    for (int row = first; row < min(first_row + ROWS + RADIUS, height) && !holds[column]; ++row) {
      global const REAL* values = derivative + (long)row * pitch + start;
      holds[column] = any((LOAD_VECTOR(0, values) != 0) | (LOAD_VECTOR(0, values + plane) != 0) |
                          (LOAD_VECTOR(0, values + 2 * plane) != 0));
    }
  }
  for (int column = 0; column < COLUMNS; ++column) {
    if (!any_near(holds, column, 2)) continue;
    const int start = (strip * STRIP + column - 1) * V;
    const int inside = start >= 0 && start < pitch;
    for (int k = 0; k < 3; ++k) {
      REALV sums[ROWS];
      if (inside && rows_whole) {
        blur_plane(derivative + k * plane + start, first_row, height, pitch, 1, sums);
      } else {
        blur_plane(derivative + k * plane + start, first_row, inside ? height : 0, pitch, 0, sums);
      }
#pragma unroll
      for (int r = 0; r < ROWS; ++r) blurred[k][r][column] = sums[r];
    }
  }
  for (int r = 0; r < ROWS && first_row + r < height; ++r) {
    const long row_begin = (long)(first_row + r) * row_length;
    for (int column = 1; column <= STRIP; ++column) {
      const int start = (strip * STRIP + column - 1) * V;
      if (start >= row_length) break;
      const REALV x = load_padded(image, first_row + r, start, height, row_length);
      const REALV d = x - load_padded(target, first_row + r, start, height, row_length);
      REALV by_ssim = 0;
      if (any_near(holds, column, 1)) {
        by_ssim = blur_horizontally(blurred[0][r], column) + 2 * (d * blur_horizontally(blurred[1][r], column) +
                                                                  x * blur_horizontally(blurred[2][r], column));
      }
      const REALV value = l1_factor * sign(d) + ssim_factor * by_ssim;
      if (start + V <= row_length) {
        STORE_VECTOR(value, 0, gradient + row_begin + start);
      } else {
        REAL lanes[V];
        STORE_VECTOR(value, 0, lanes);
        for (int lane = 0; start + lane < row_length; ++lane) gradient[row_begin + start + lane] = lanes[lane];
      }
    }
  }
}
