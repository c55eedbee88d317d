// L1 and structural dissimilarity of two (H,W,C) images in one pass, and their gradient in a second.
//   partial = l1_factor * sum |d| + ssim_factor * sum (1 - SSIM),   d = image - target
// SSIM after Wang et al. 2004 with an 11x11 Gaussian window of sigma 1.5, C1 = 0.01^2, C2 = 0.03^2 (range 1), zero padding
// outside the image ('same' size, as 3DGS codes do). With window means m and E[.], it is evaluated in the equal form
//   1 - SSIM = a + b - a b,   a = m_d^2 / (m_x^2 + m_y^2 + C1),   b = V_d / (V_x + V_y + C2),
//   V_d = E[d^2] - m_d^2 and V_x + V_y = E[x^2 + y^2] - m_x^2 - m_y^2, both clamped at 0,
// so rounding can never lift SSIM above 1 and nearly equal images keep their digits. Four blurs forward (x, d, d^2,
// x^2 + y^2), three backward (derivatives by m_x, E[d^2], E[x^2 + y^2]).
// Arrays: image, target, gradient (H, row_length), row_length = W * CHANNELS. derivative (3, H, pitch): pitch a multiple of
// V, columns past row_length are written as zeros; null when no gradient is wanted. `margin` pixels at each border
// are left out of the sums (the gradient kernel knows margin 0 only).
// -D CHANNELS: interleaved channels, 1..3. WIDE=1: a work-item owns ROWS x STRIP vectors; no local memory;
// V is 16. WIDE=0: a work-group of TILE x TILE items owns as many pixels of one channel; V must be 1.
// Launch: WIDE (ceil(pitch / (STRIP V)), ceil(H / ROWS)), local (1, 1), one slot of `partial` each, row by row.
//         GPU (ceil(W / TILE) TILE, ceil(H / TILE) TILE, CHANNELS), local (TILE, TILE, 1), likewise.
// Deterministic: every number is written once, sums have a fixed order.
#include "common/real.cl"

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

#if WIDE

#define ROWS 4
#define STRIP 16
// Columns (of vectors) blurred vertically: the strip and one vector on either side for the horizontal taps.
#define COLUMNS (STRIP + 2)

#define LANE_NUMBERS (REALV)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)

// V values of a row from `column`, a multiple of V, on; zeros outside 0 .. row_length.
REALV load_padded(global const REAL* image, const int row, const int column, const int height, const int row_length) {
  if (column < 0 || column >= row_length) return 0;
  const int rest = row_length - column;
  global const REAL* values = image + (long)row * row_length + column;
  if (rest >= V) return LOAD_VECTOR(0, values);
  // Behind a row lie the next ones.
  if ((long)(height - row) * row_length - column >= V) return LANE_NUMBERS < (REALV)rest ? LOAD_VECTOR(0, values) : (REALV)0;
  REAL lanes[V];
  for (int lane = 0; lane < V; ++lane) lanes[lane] = lane < rest ? values[lane] : 0;
  return LOAD_VECTOR(0, lanes);
}

// out[row] = vertical blur at output row `row` of rows[0 .. ROWS + TAPS - 1)
#define BLUR_VERTICALLY(expression, out)                            \
  do {                                                              \
    REALV sums[ROWS];                                               \
    _Pragma("unroll") for (int r = 0; r < ROWS; ++r) sums[r] = 0;   \
    _Pragma("unroll") for (int i = 0; i < ROWS + TAPS - 1; ++i) {   \
      const REALV value = expression;                               \
      _Pragma("unroll") for (int r = 0; r < ROWS; ++r) {            \
        if (i >= r && i - r < TAPS) sums[r] += window[i - r] * value; \
      }                                                             \
    }                                                               \
    _Pragma("unroll") for (int r = 0; r < ROWS; ++r) out[r][column] = sums[r]; \
  } while (0)

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
  for (int column = 0; column < COLUMNS; ++column) {
    const int start = (strip * STRIP + column - 1) * V;
    REALV x[ROWS + TAPS - 1], d[ROWS + TAPS - 1];
    for (int i = 0; i < ROWS + TAPS - 1; ++i) {
      const int row = first_row + i - RADIUS;
      x[i] = 0;
      d[i] = 0;
      if (row >= 0 && row < height) {
        x[i] = load_padded(image, row, start, height, row_length);
        d[i] = x[i] - load_padded(target, row, start, height, row_length);
      }
    }
    BLUR_VERTICALLY(x[i], mean_x);
    BLUR_VERTICALLY(d[i], mean_d);
    BLUR_VERTICALLY(d[i] * d[i], square_d);
    BLUR_VERTICALLY(x[i] * x[i] + (x[i] - d[i]) * (x[i] - d[i]), square_sum);
  }
  REALV total = 0;
  for (int r = 0; r < ROWS && first_row + r < height; ++r) {
    const int row = first_row + r;
    const REAL row_counts = row >= margin && row < height - margin ? 1 : 0;
    for (int column = 1; column <= STRIP; ++column) {
      const int start = (strip * STRIP + column - 1) * V;
      if (start >= row_length) break;
      const REALV position = LANE_NUMBERS + start;
      const REALV counts = row_counts * step((REALV)(margin * CHANNELS), position) *
                           step(position, (REALV)(row_length - margin * CHANNELS - 1));
      REALV by_mean, by_square_d, by_square_sum;
      const REALV value = dissimilarity(blur_horizontally(mean_x[r], column), blur_horizontally(mean_d[r], column),
                                        blur_horizontally(square_d[r], column), blur_horizontally(square_sum[r], column),
                                        &by_mean, &by_square_d, &by_square_sum);
      const REALV d = load_padded(image, row, start, height, row_length) -
                      load_padded(target, row, start, height, row_length);
      total += counts * (l1_factor * fabs(d) + ssim_factor * value);
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

// gradient = upstream[0] * (l1_factor * sign(d) + ssim_factor * d sum (1 - SSIM) / d image)
kernel void ssim_backward(global const REAL* image, global const REAL* target, global const REAL* derivative,
                          global const REAL* upstream, global REAL* gradient, const REAL l1_factor, const REAL ssim_factor,
                          const int height, const int row_length, const int pitch) {
  const int strip = get_global_id(0), first_row = get_global_id(1) * ROWS;
  const long plane = (long)height * pitch;
  REALV blurred[3][ROWS][COLUMNS];
  for (int column = 0; column < COLUMNS; ++column) {
    const int start = (strip * STRIP + column - 1) * V;
    const int inside = start >= 0 && start < pitch;
    for (int k = 0; k < 3; ++k) {
      REALV values[ROWS + TAPS - 1];
      for (int i = 0; i < ROWS + TAPS - 1; ++i) {
        const int row = first_row + i - RADIUS;
        values[i] = 0;
        if (inside && row >= 0 && row < height) values[i] = LOAD_VECTOR(0, derivative + k * plane + (long)row * pitch + start);
      }
      BLUR_VERTICALLY(values[i], blurred[k]);
    }
  }
  for (int r = 0; r < ROWS && first_row + r < height; ++r) {
    const long row_begin = (long)(first_row + r) * row_length;
    for (int column = 1; column <= STRIP; ++column) {
      const int start = (strip * STRIP + column - 1) * V;
      if (start >= row_length) break;
      const REALV x = load_padded(image, first_row + r, start, height, row_length);
      const REALV d = x - load_padded(target, first_row + r, start, height, row_length);
      const REALV by_ssim = blur_horizontally(blurred[0][r], column) +
                            2 * (d * blur_horizontally(blurred[1][r], column) + x * blur_horizontally(blurred[2][r], column));
      const REALV value = upstream[0] * (l1_factor * sign(d) + ssim_factor * by_ssim);
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

#else

#define TILE 16
#define HALO (TILE + 2 * RADIUS)

kernel void ssim_forward(global const REAL* image, global const REAL* target, global REAL* derivative,
                         global REAL* partial, const REAL l1_factor, const REAL ssim_factor, const int height,
                         const int row_length, const int pitch, const int margin) {
  local REAL x[HALO][HALO], d[HALO][HALO];
  local REAL rows[4][HALO][TILE];  // horizontal blurs
  local REAL sums[TILE * TILE];
  const int channel = get_global_id(2), width = row_length / CHANNELS;
  const int left = get_group_id(0) * TILE, top = get_group_id(1) * TILE;
  const int local_x = get_local_id(0), local_y = get_local_id(1), item = local_y * TILE + local_x;
  for (int i = item; i < HALO * HALO; i += TILE * TILE) {
    const int column = left + i % HALO - RADIUS, row = top + i / HALO - RADIUS;
    const int inside = column >= 0 && column < width && row >= 0 && row < height;
    const long element = (long)row * row_length + column * CHANNELS + channel;
    const REAL value = inside ? image[element] : 0;
    x[i / HALO][i % HALO] = value;
    d[i / HALO][i % HALO] = inside ? value - target[element] : 0;
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int i = item; i < HALO * TILE; i += TILE * TILE) {
    const int row = i / TILE, column = i % TILE;
    REAL mean_x = 0, mean_d = 0, square_d = 0, square_sum = 0;
    for (int tap = 0; tap < TAPS; ++tap) {
      const REAL value = x[row][column + tap], difference = d[row][column + tap], other = value - difference;
      mean_x += window[tap] * value;
      mean_d += window[tap] * difference;
      square_d += window[tap] * difference * difference;
      square_sum += window[tap] * (value * value + other * other);
    }
    rows[0][row][column] = mean_x;
    rows[1][row][column] = mean_d;
    rows[2][row][column] = square_d;
    rows[3][row][column] = square_sum;
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  REAL blurred[4] = {0, 0, 0, 0};
  for (int tap = 0; tap < TAPS; ++tap) {
    for (int k = 0; k < 4; ++k) blurred[k] += window[tap] * rows[k][local_y + tap][local_x];
  }
  const int column = left + local_x, row = top + local_y;
  const int counts = column >= margin && column < width - margin && row >= margin && row < height - margin;
  REAL by_mean, by_square_d, by_square_sum;
  const REAL value = dissimilarity(blurred[0], blurred[1], blurred[2], blurred[3], &by_mean, &by_square_d, &by_square_sum);
  const REAL difference = d[local_y + RADIUS][local_x + RADIUS];
  sums[item] = counts ? l1_factor * fabs(difference) + ssim_factor * value : 0;
  if (derivative && column < width && row < height) {
    global REAL* out = derivative + (long)row * pitch + column * CHANNELS + channel;
    const long plane = (long)height * pitch;
    out[0] = counts * by_mean;
    out[plane] = counts * by_square_d;
    out[2 * plane] = counts * by_square_sum;
  }
  for (int half_size = TILE * TILE / 2; half_size > 0; half_size /= 2) {
    barrier(CLK_LOCAL_MEM_FENCE);
    if (item < half_size) sums[item] += sums[item + half_size];
  }
  if (item == 0) partial[(channel * get_num_groups(1) + get_group_id(1)) * get_num_groups(0) + get_group_id(0)] = sums[0];
}

// gradient = upstream[0] * (l1_factor * sign(d) + ssim_factor * d sum (1 - SSIM) / d image)
kernel void ssim_backward(global const REAL* image, global const REAL* target, global const REAL* derivative,
                          global const REAL* upstream, global REAL* gradient, const REAL l1_factor, const REAL ssim_factor,
                          const int height, const int row_length, const int pitch) {
  local REAL values[3][HALO][HALO];
  local REAL rows[3][HALO][TILE];
  const int channel = get_global_id(2), width = row_length / CHANNELS;
  const int left = get_group_id(0) * TILE, top = get_group_id(1) * TILE;
  const int local_x = get_local_id(0), local_y = get_local_id(1), item = local_y * TILE + local_x;
  const long plane = (long)height * pitch;
  for (int i = item; i < HALO * HALO; i += TILE * TILE) {
    const int column = left + i % HALO - RADIUS, row = top + i / HALO - RADIUS;
    const int inside = column >= 0 && column < width && row >= 0 && row < height;
    const long element = (long)row * pitch + column * CHANNELS + channel;
    for (int k = 0; k < 3; ++k) values[k][i / HALO][i % HALO] = inside ? derivative[k * plane + element] : 0;
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int i = item; i < HALO * TILE; i += TILE * TILE) {
    const int row = i / TILE, column = i % TILE;
    for (int k = 0; k < 3; ++k) {
      REAL sum = 0;
      for (int tap = 0; tap < TAPS; ++tap) sum += window[tap] * values[k][row][column + tap];
      rows[k][row][column] = sum;
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  REAL blurred[3] = {0, 0, 0};
  for (int tap = 0; tap < TAPS; ++tap) {
    for (int k = 0; k < 3; ++k) blurred[k] += window[tap] * rows[k][local_y + tap][local_x];
  }
  const int column = left + local_x, row = top + local_y;
  if (column < width && row < height) {
    const long element = (long)row * row_length + column * CHANNELS + channel;
    const REAL x = image[element], d = x - target[element];
    const REAL by_ssim = blurred[0] + 2 * (d * blurred[1] + x * blurred[2]);
    gradient[element] = upstream[0] * (l1_factor * sign(d) + ssim_factor * by_ssim);
  }
}

#endif
