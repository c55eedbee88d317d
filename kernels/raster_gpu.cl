// Rasterisation of projected splats by cooperative work-groups: a work-group of TILE_WIDTH x TILE_HEIGHT items owns a
// tile, an item a pixel; batches of splats pass through local memory.
// Backward: the items of a tile leave what each pixel owes a batch of splats in local memory, then SUMMERS items a
// splat sum it over the pixels in a fixed order and one item a number adds the partial sums. No atomics: deterministic.
// -D TILE_WIDTH, TILE_HEIGHT: a multiple of BATCH pixels together; BATCH: splats a backward round;
// SMOOTH_CUTOFF=0|1: alpha fades in between ALPHA_MIN and 2 ALPHA_MIN instead of stepping (for finite differences).
// Arrays as in raster_wide.cl. Local memory at 16x16 pixels: 13 KB forward, 29 KB backward with BATCH 8 in float; 26
// and 41 KB with BATCH 4 in double.
// Launch: global = tile grid times tile size, local = (TILE_WIDTH, TILE_HEIGHT); items outside the image keep step at
// barriers.
#include "common/real.cl"
#include "common/splat.cl"

#define PIXELS (TILE_WIDTH * TILE_HEIGHT)
#define SUMMERS (PIXELS / BATCH)
#define FIELDS (RECORD_COLOR + 3)

// The s and t of a record's Gaussian at a place of the image (common/splat.cl).
inline REAL s_at(local const REAL* record, const REAL x, const REAL y) {
  return record[RECORD_SHARPNESS_X] * (x - record[RECORD_U] - record[RECORD_SLOPE] * (y - record[RECORD_V]));
}

inline REAL t_at(local const REAL* record, const REAL y) {
  return record[RECORD_SHARPNESS_Y] * (y - record[RECORD_V]);
}

// log2(alpha) there.
inline REAL exponent_at(local const REAL* record, const REAL x, const REAL y) {
  const REAL s = s_at(record, x, y), t = t_at(record, y);
  return record[RECORD_LOG2_OPACITY] - t * t - s * s;
}

#if SMOOTH_CUTOFF
inline REAL fade(const REAL alpha) {
  const REAL t = fmin(fmax(alpha / ALPHA_MIN - 1, (REAL)0), (REAL)1);
  return t * t * (3 - 2 * t);
}
// d (alpha fade(alpha)) / d ln(alpha), for unclamped alpha
inline REAL fade_slope(const REAL alpha) {
  const REAL t = fmin(fmax(alpha / ALPHA_MIN - 1, (REAL)0), (REAL)1);
  return alpha * (t * t * (3 - 2 * t) + alpha / ALPHA_MIN * 6 * t * (1 - t));
}
#endif

kernel void raster_forward(global const REAL* records, global const uint* tile_starts, global const uint2* entries,
                           global REAL* color, global REAL* alpha, global REAL* transmittance,
                           global int* contributors, const REAL background_red, const REAL background_green,
                           const REAL background_blue, const int width, const int height, const int first_tile) {
  local REAL batch[PIXELS * FIELDS];
  local int open_pixels[PIXELS];
  local int any_open;
  const int column = get_global_id(0), row = get_global_id(1);
  const int item = get_local_id(1) * TILE_WIDTH + get_local_id(0);
  const int tile = first_tile + get_group_id(1) * get_num_groups(0) + get_group_id(0);
  const int inside = column < width && row < height;
  const REAL x = column + (REAL)0.5, y = row + (REAL)0.5;
  const uint begin = tile_starts[tile], end = tile_starts[tile + 1];
  REAL left_over = inside ? 1 : 0, red = 0, green = 0, blue = 0;
  int last = 0;

  for (uint start = begin; start < end; start += PIXELS) {
    open_pixels[item] = left_over >= TRANSMITTANCE_MIN;
    if (start + item < end) {
      global const REAL* record = records + (long)entries[start + item].x * RECORD_SIZE;
      for (int field = 0; field < FIELDS; ++field) batch[item * FIELDS + field] = record[field];
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    if (item == 0) {
      int open = 0;
      for (int p = 0; p < PIXELS; ++p) open |= open_pixels[p];
      any_open = open;
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    if (!any_open) break;  // the same for the whole work-group
    const int size = (int)min(end - start, (uint)PIXELS);
    for (int k = 0; k < size && left_over >= TRANSMITTANCE_MIN; ++k) {
      local const REAL* record = batch + k * FIELDS;
      const REAL exponent = exponent_at(record, x, y);
      if (!(exponent >= LOG2_ALPHA_MIN)) continue;
      REAL a = fmin(exp2_in_range(exponent), ALPHA_MAX);
#if SMOOTH_CUTOFF
      a *= fade(a);
#endif
      const REAL weight = a * left_over;
      red += weight * record[RECORD_COLOR];
      green += weight * record[RECORD_COLOR + 1];
      blue += weight * record[RECORD_COLOR + 2];
      left_over -= weight;
      last = (int)(start + k + 1);
    }
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  if (inside) {
    const long pixel = (long)row * width + column;
    color[pixel * 3] = red + left_over * background_red;
    color[pixel * 3 + 1] = green + left_over * background_green;
    color[pixel * 3 + 2] = blue + left_over * background_blue;
    alpha[pixel] = 1 - left_over;
    transmittance[pixel] = left_over;
    contributors[pixel] = last;
  }
}

kernel void raster_backward(global const REAL* records, global const uint* tile_starts, global const uint2* entries,
                            global const REAL* transmittance, global const int* contributors,
                            global const REAL* d_color, global const REAL* d_alpha, global REAL* slots,
                            const REAL background_red, const REAL background_green, const REAL background_blue,
                            const int width, const int height, const int first_tile) {
  local REAL batch[BATCH * FIELDS];
  local REAL d_exponents[BATCH * PIXELS], weights[BATCH * PIXELS];
  local REAL d_reds[PIXELS], d_greens[PIXELS], d_blues[PIXELS];
  local REAL partial[PIXELS * SLOT_USED];
  local uint batch_slots[BATCH];
  local uint used_end;
  const int column = get_global_id(0), row = get_global_id(1);
  const int item = get_local_id(1) * TILE_WIDTH + get_local_id(0);
  const int tile = first_tile + get_group_id(1) * get_num_groups(0) + get_group_id(0);
  const int left = get_group_id(0) * TILE_WIDTH, top = get_group_id(1) * TILE_HEIGHT;
  const int inside = column < width && row < height;
  const long pixel = inside ? (long)row * width + column : 0;
  const REAL x = column + (REAL)0.5, y = row + (REAL)0.5;
  const uint begin = tile_starts[tile], end = tile_starts[tile + 1];
  const REAL d_red = inside ? d_color[pixel * 3] : 0, d_green = inside ? d_color[pixel * 3 + 1] : 0,
             d_blue = inside ? d_color[pixel * 3 + 2] : 0, d_opaque = inside ? d_alpha[pixel] : 0;
  const uint last = inside ? (uint)contributors[pixel] : 0;
  REAL left_over = transmittance[pixel];
  REAL behind = d_red * background_red + d_green * background_green + d_blue * background_blue;
  d_reds[item] = d_red;
  d_greens[item] = d_green;
  d_blues[item] = d_blue;

  // Behind the last contributor of all pixels there is nothing to walk through.
  if (item == 0) used_end = begin;
  barrier(CLK_LOCAL_MEM_FENCE);
  atomic_max(&used_end, last);  // of integers: the same in any order
  barrier(CLK_LOCAL_MEM_FENCE);
  for (uint i = used_end + item; i < end; i += PIXELS) {
    for (int field = 0; field < SLOT_USED; ++field) slots[(long)entries[i].y * SLOT_SIZE + field] = 0;
  }

  // Batches from the back; the first item of a batch is `start`.
  const uint batches = (used_end - begin + BATCH - 1) / BATCH;
  for (uint b = batches; b-- > 0;) {
    const uint start = begin + b * BATCH;
    const int size = (int)min(used_end - start, (uint)BATCH);
    for (int k = item; k < size * FIELDS; k += PIXELS) {
      const uint2 entry = entries[start + k / FIELDS];
      batch[k] = records[(long)entry.x * RECORD_SIZE + k % FIELDS];
      if (k % FIELDS == 0) batch_slots[k / FIELDS] = entry.y;
    }
    barrier(CLK_LOCAL_MEM_FENCE);

    for (int k = size; k-- > 0;) {
      local const REAL* record = batch + k * FIELDS;
      const REAL exponent = exponent_at(record, x, y);
      REAL weight = 0, d_exponent = 0;
      if (exponent >= LOG2_ALPHA_MIN && start + k < last) {
        const REAL plain = exp2_in_range(exponent);
        REAL a = fmin(plain, ALPHA_MAX);
#if SMOOTH_CUTOFF
        const REAL by_exponent = plain < ALPHA_MAX ? fade_slope(a) : 0;
        a *= fade(a);
#else
        const REAL by_exponent = plain < ALPHA_MAX ? a : 0;
#endif
        left_over /= 1 - a;
        const REAL worth = d_red * record[RECORD_COLOR] + d_green * record[RECORD_COLOR + 1] +
                           d_blue * record[RECORD_COLOR + 2] + d_opaque;
        const REAL gain = worth - behind;
        behind += a * gain;
        weight = a * left_over;
        d_exponent = by_exponent * left_over * gain;
      }
      d_exponents[k * PIXELS + item] = d_exponent;
      weights[k * PIXELS + item] = weight;
    }
    barrier(CLK_LOCAL_MEM_FENCE);

    // SUMMERS items a splat, each over every SUMMERS-th pixel.
    const int k = item / SUMMERS, lane = item % SUMMERS;
    REAL sums[SLOT_USED];
    for (int field = 0; field < SLOT_USED; ++field) sums[field] = 0;
    if (k < size) {
      for (int p = lane; p < PIXELS; p += SUMMERS) {
        const REAL w = d_exponents[k * PIXELS + p], weight = weights[k * PIXELS + p];
        const REAL pixel_x = left + p % TILE_WIDTH + (REAL)0.5, pixel_y = top + p / TILE_WIDTH + (REAL)0.5;
        const REAL s = s_at(batch + k * FIELDS, pixel_x, pixel_y), t = t_at(batch + k * FIELDS, pixel_y);
        sums[0] += w;
        sums[1] += w * s;
        sums[2] += w * t;
        sums[3] += w * s * s;
        sums[4] += w * s * t;
        sums[5] += w * t * t;
        sums[6] += weight * d_reds[p];
        sums[7] += weight * d_greens[p];
        sums[8] += weight * d_blues[p];
      }
    }
    for (int field = 0; field < SLOT_USED; ++field) partial[item * SLOT_USED + field] = sums[field];
    barrier(CLK_LOCAL_MEM_FENCE);
    for (int n = item; n < size * SLOT_USED; n += PIXELS) {
      const int splat = n / SLOT_USED, field = n % SLOT_USED;
      REAL total = 0;
      for (int s = 0; s < SUMMERS; ++s) total += partial[(splat * SUMMERS + s) * SLOT_USED + field];
      slots[(long)batch_slots[splat] * SLOT_SIZE + field] = total;
    }
    barrier(CLK_LOCAL_MEM_FENCE);
  }
}
