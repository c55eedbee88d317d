// L1 and structural dissimilarity of two images (common/ssim.cl) by cooperative work-groups: TILE x TILE items own as
// many pixels of one channel; images, and what is blurred horizontally, pass through local memory.
// -D V=1; CHANNELS: interleaved channels, 1..3.
// Launch: (ceil(W / TILE) TILE, ceil(H / TILE) TILE, CHANNELS), local (TILE, TILE, 1); one slot of `partial` a group.
// Deterministic: every number is written once, sums have a fixed order.
#include "common/real.cl"
#include "common/ssim.cl"

#define TILE 16
#define HALO (TILE + 2 * RADIUS)

kernel void ssim_forward(global const REAL* image, global const REAL* target, global REAL* derivative,
                         global REAL* partial, const REAL l1_factor, const REAL ssim_factor, const int height,
                         const int row_length, const int pitch, const int margin) {
  local REAL x[HALO][HALO], d[HALO][HALO];
  local REAL rows[4][HALO][TILE];  // horizontal blurs
  local REAL sums[TILE * TILE];
  local int differs;  // set by any item, all of the same value
  const int channel = get_global_id(2), width = row_length / CHANNELS;
  const int left = get_group_id(0) * TILE, top = get_group_id(1) * TILE;
  const int local_x = get_local_id(0), local_y = get_local_id(1), item = local_y * TILE + local_x;
  if (item == 0) differs = 0;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int i = item; i < HALO * HALO; i += TILE * TILE) {
    const int column = left + i % HALO - RADIUS, row = top + i / HALO - RADIUS;
    const int inside = column >= 0 && column < width && row >= 0 && row < height;
    const long element = (long)row * row_length + column * CHANNELS + channel;
    const REAL value = inside ? image[element] : 0, difference = inside ? value - target[element] : 0;
    x[i / HALO][i % HALO] = value;
    d[i / HALO][i % HALO] = difference;
    if (difference != 0) differs = 1;
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int i = differs ? item : HALO * TILE; i < HALO * TILE; i += TILE * TILE) {
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
  for (int tap = differs ? 0 : TAPS; tap < TAPS; ++tap) {
    for (int k = 0; k < 4; ++k) blurred[k] += window[tap] * rows[k][local_y + tap][local_x];
  }
  const int column = left + local_x, row = top + local_y;
  const int counts =
      differs && column >= margin && column < width - margin && row >= margin && row < height - margin;
  REAL by_mean, by_square_d, by_square_sum;
  const REAL value =
      dissimilarity(blurred[0], blurred[1], blurred[2], blurred[3], &by_mean, &by_square_d, &by_square_sum);
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
  if (item == 0) {
    partial[(channel * get_num_groups(1) + get_group_id(1)) * get_num_groups(0) + get_group_id(0)] = sums[0];
  }
}

kernel void ssim_backward(global const REAL* image, global const REAL* target, global const REAL* derivative,
                          global REAL* gradient, const REAL l1_factor, const REAL ssim_factor, const int height,
                          const int row_length, const int pitch) {
  local REAL values[3][HALO][HALO];
  local REAL rows[3][HALO][TILE];
  local int holds;  // set by any item, all of the same value
  const int channel = get_global_id(2), width = row_length / CHANNELS;
  const int left = get_group_id(0) * TILE, top = get_group_id(1) * TILE;
  const int local_x = get_local_id(0), local_y = get_local_id(1), item = local_y * TILE + local_x;
  const long plane = (long)height * pitch;
  if (item == 0) holds = 0;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int i = item; i < HALO * HALO; i += TILE * TILE) {
    const int column = left + i % HALO - RADIUS, row = top + i / HALO - RADIUS;
    const int inside = column >= 0 && column < width && row >= 0 && row < height;
    const long element = (long)row * pitch + column * CHANNELS + channel;
    for (int k = 0; k < 3; ++k) {
      const REAL value = inside ? derivative[k * plane + element] : 0;
      values[k][i / HALO][i % HALO] = value;
      if (value != 0) holds = 1;
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int i = holds ? item : HALO * TILE; i < HALO * TILE; i += TILE * TILE) {
    const int row = i / TILE, column = i % TILE;
    for (int k = 0; k < 3; ++k) {
      REAL sum = 0;
      for (int tap = 0; tap < TAPS; ++tap) sum += window[tap] * values[k][row][column + tap];
      rows[k][row][column] = sum;
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  REAL blurred[3] = {0, 0, 0};
  for (int tap = holds ? 0 : TAPS; tap < TAPS; ++tap) {
    for (int k = 0; k < 3; ++k) blurred[k] += window[tap] * rows[k][local_y + tap][local_x];
  }
  const int column = left + local_x, row = top + local_y;
  if (column < width && row < height) {
    const long element = (long)row * row_length + column * CHANNELS + channel;
    const REAL x = image[element], d = x - target[element];
    const REAL by_ssim = blurred[0] + 2 * (d * blurred[1] + x * blurred[2]);
    gradient[element] = l1_factor * sign(d) + ssim_factor * by_ssim;
  }
}
