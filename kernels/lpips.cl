// The parts of LPIPS (Zhang et al. 2018, v0.1) that are no convolution or pooling.
// -D GROUP: items that share a pixel's channels, a power of two; 1 when WIDE.
// Launch: *_input one item per pixel, local size free; feature_* one group of GROUP items per pixel.
// Deterministic: every number is written once, sums have a fixed order.
#include "common/real.cl"
#include "common/group_sum.cl"
#include "common/tail.cl"

// The network's input: (2 rgb - 1 - shift) / scale; images (pixels, 3) in 0..1.
constant REAL input_shift[3] = {(REAL)-0.030, (REAL)-0.088, (REAL)-0.188};
constant REAL input_scale[3] = {(REAL)0.458, (REAL)0.448, (REAL)0.450};

kernel void normalize_input(global const REAL* image, global REAL* output, const long pixels) {
  const long pixel = get_global_id(0);
  if (pixel >= pixels) return;
  for (int c = 0; c < 3; ++c) output[3 * pixel + c] = (2 * image[3 * pixel + c] - 1 - input_shift[c]) / input_scale[c];
}

kernel void normalize_input_gradient(global const REAL* output_gradient, global REAL* gradient, const long pixels) {
  const long pixel = get_global_id(0);
  if (pixel >= pixels) return;
  for (int c = 0; c < 3; ++c) gradient[3 * pixel + c] = 2 / input_scale[c] * output_gradient[3 * pixel + c];
}

#define EPSILON ((REAL)1e-10)

// Euclidean length of a pixel's channels, for every item of the group.
REAL length_of(global const REAL* feature, const int channels, local REAL* scratch) {
  REALV squares = 0;
  for (int c = get_local_id(0) * V; c < channels; c += GROUP * V) {
    const REALV value = load_tail(feature + c, channels - c);
    squares += value * value;
  }
  return sqrt(sum_of_group(sum_of_lanes(squares), scratch));
}

// distance[p] = sum_c weight[c] (a_c / (|a| + 1e-10) - b_c / (|b| + 1e-10))^2 for the features a, b of pixel p
kernel void feature_distance(global const REAL* feature, global const REAL* target, global const REAL* weight,
                             global REAL* distance, local REAL* scratch, const int channels) {
  const long pixel = get_group_id(0);
  feature += pixel * channels;
  target += pixel * channels;
  const REAL inverse = 1 / (length_of(feature, channels, scratch) + EPSILON);
  const REAL target_inverse = 1 / (length_of(target, channels, scratch) + EPSILON);
  REALV sums = 0;
  for (int c = get_local_id(0) * V; c < channels; c += GROUP * V) {
    const int count = channels - c;
    const REALV difference = inverse * load_tail(feature + c, count) - target_inverse * load_tail(target + c, count);
    sums += load_tail(weight + c, count) * difference * difference;
  }
  const REAL total = sum_of_group(sum_of_lanes(sums), scratch);
  if (get_local_id(0) == 0) distance[pixel] = total;
}

// A pixel whose features are all zero gets no gradient: its direction is undefined.
kernel void feature_distance_gradient(global const REAL* feature, global const REAL* target, global const REAL* weight,
                                      global const REAL* distance_gradient, global REAL* gradient, local REAL* scratch,
                                      const int channels) {
  const long pixel = get_group_id(0);
  feature += pixel * channels;
  target += pixel * channels;
  gradient += pixel * channels;
  const REAL length = length_of(feature, channels, scratch);
  const REAL inverse = length > 0 ? 1 / (length + EPSILON) : 0;
  const REAL target_inverse = 1 / (length_of(target, channels, scratch) + EPSILON);
  const REAL factor = 2 * distance_gradient[pixel] * inverse;
  REALV products = 0;
  for (int c = get_local_id(0) * V; c < channels; c += GROUP * V) {
    const int count = channels - c;
    const REALV unit = inverse * load_tail(feature + c, count);
    products += load_tail(weight + c, count) * (unit - target_inverse * load_tail(target + c, count)) * unit;
  }
  const REAL along = sum_of_group(sum_of_lanes(products), scratch) * (length > 0 ? (length + EPSILON) / length : 0);
  for (int c = get_local_id(0) * V; c < channels; c += GROUP * V) {
    const int count = channels - c;
    const REALV unit = inverse * load_tail(feature + c, count);
    const REALV difference = unit - target_inverse * load_tail(target + c, count);
    store_tail(factor * (load_tail(weight + c, count) * difference - along * unit), gradient + c, count);
  }
}
