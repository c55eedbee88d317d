// Moving channels and regions of images (N, H, W, C): concatenate, split, repeat, tile and mask, overwrite a rectangle.
// Channel counts are arbitrary; whole vectors of V first, the rest one by one.
// Launch, unless said otherwise: one item per pixel (N H W).
// Deterministic: no element is written twice; sums have a fixed order.
#include "common/real.cl"

void copy_run(global const REAL* source, global REAL* target, const int count) {
  int c = 0;
  for (; c + V <= count; c += V) STORE_VECTOR(LOAD_VECTOR(0, source + c), 0, target + c);
  for (; c < count; ++c) target[c] = source[c];
}

void zero_run(global REAL* target, const int count) {
  for (int c = 0; c < count; ++c) target[c] = 0;
}

// target[p, target_first ..] = source[p, source_first ..], `count` channels.
kernel void copy_channels(global const REAL* source, const int source_channels, const int source_first,
                          global REAL* target, const int target_channels, const int target_first, const int count,
                          const int pixels) {
  const int p = get_global_id(0);
  if (p >= pixels) return;
  copy_run(source + (long)p * source_channels + source_first, target + (long)p * target_channels + target_first, count);
}

// output = input's channels, `times` times over.
kernel void repeat_channels(global const REAL* input, global REAL* output, const int channels, const int times,
                            const int pixels) {
  const int p = get_global_id(0);
  if (p >= pixels) return;
  for (int t = 0; t < times; ++t) {
    copy_run(input + (long)p * channels, output + ((long)p * times + t) * channels, channels);
  }
}

kernel void repeat_channels_backward(global const REAL* output_gradient, global REAL* input_gradient,
                                     const int channels, const int times, const int pixels) {
  const int p = get_global_id(0);
  if (p >= pixels) return;
  global const REAL* from = output_gradient + (long)p * times * channels;
  global REAL* to = input_gradient + (long)p * channels;
  int c = 0;
  for (; c + V <= channels; c += V) {
    REALV sums = 0;
    for (int t = 0; t < times; ++t) sums += LOAD_VECTOR(0, from + t * channels + c);
    STORE_VECTOR(sums, 0, to + c);
  }
  for (; c < channels; ++c) {
    REAL sum = 0;
    for (int t = 0; t < times; ++t) sum += from[t * channels + c];
    to[c] = sum;
  }
}

// output[n, p, c] = values[n, c] * mask[p, c]. pixels_each = H W of one image.
kernel void tile_masked(global const REAL* values, global const REAL* mask, global REAL* output, const int channels,
                        const int pixels_each, const int pixels) {
  const int p = get_global_id(0);
  if (p >= pixels) return;
  global const REAL* value = values + (long)(p / pixels_each) * channels;
  global const REAL* weight = mask + (long)(p % pixels_each) * channels;
  global REAL* target = output + (long)p * channels;
  int c = 0;
  for (; c + V <= channels; c += V) STORE_VECTOR(LOAD_VECTOR(0, value + c) * LOAD_VECTOR(0, weight + c), 0, target + c);
  for (; c < channels; ++c) target[c] = value[c] * weight[c];
}

// partial[chunk, n, c] = sum of output_gradient * mask over the chunk's pixels of image n. Launch: (C, chunks, N).
kernel void tile_masked_backward(global const REAL* mask, global const REAL* output_gradient, global REAL* partial,
                                 const int channels, const int pixels_each, const int chunk_pixels, const int images) {
  const int c = get_global_id(0), chunk = get_global_id(1), n = get_global_id(2);
  const int begin = chunk * chunk_pixels, end = min(begin + chunk_pixels, pixels_each);
  if (c >= channels || begin >= pixels_each || n >= images) return;
  global const REAL* gradient = output_gradient + (long)n * pixels_each * channels;
  REAL sum = 0;
  for (int p = begin; p < end; ++p) sum += gradient[(long)p * channels + c] * mask[(long)p * channels + c];
  partial[((long)chunk * images + n) * channels + c] = sum;
}

// values' gradient = sum over chunks. Launch: one item per value (N C).
kernel void sum_chunks(global const REAL* partial, global REAL* gradient, const int chunks, const int count) {
  const int i = get_global_id(0);
  if (i >= count) return;
  REAL sum = 0;
  for (int chunk = 0; chunk < chunks; ++chunk) sum += partial[(long)chunk * count + i];
  gradient[i] = sum;
}

// A rectangle of an image, and the channels of it that take part.
typedef struct {
  int image_height, image_width, image_channels;  // of the large image
  int height, width, channels;                    // of the patch
  int top, left, first_channel;                   // where the patch lies in the image
  int used_channels;                              // the patch's first channels, those that are copied
} Region;

// output = base, with the patch's first channels in place of the region's. One item per pixel of the base.
kernel void overwrite_region(global const REAL* base, global const REAL* patch, global REAL* output,
                             const Region region, const int pixels) {
  const int p = get_global_id(0);
  if (p >= pixels) return;
  const int x = p % region.image_width, y = p / region.image_width % region.image_height;
  const int n = p / (region.image_width * region.image_height);
  const int row = y - region.top, column = x - region.left;
  copy_run(base + (long)p * region.image_channels, output + (long)p * region.image_channels, region.image_channels);
  if (row < 0 || row >= region.height || column < 0 || column >= region.width) return;
  copy_run(patch + (((long)n * region.height + row) * region.width + column) * region.channels,
           output + (long)p * region.image_channels + region.first_channel, region.used_channels);
}

// The base gets the gradient outside the region. One item per pixel of the base.
kernel void overwrite_region_base_backward(global const REAL* output_gradient, global REAL* base_gradient,
                                           const Region region, const int pixels) {
  const int p = get_global_id(0);
  if (p >= pixels) return;
  const int x = p % region.image_width, y = p / region.image_width % region.image_height;
  const int row = y - region.top, column = x - region.left;
  const long start = (long)p * region.image_channels;
  copy_run(output_gradient + start, base_gradient + start, region.image_channels);
  if (row < 0 || row >= region.height || column < 0 || column >= region.width) return;
  zero_run(base_gradient + start + region.first_channel, region.used_channels);
}

// The patch gets it inside; channels that were not used get 0. One item per pixel of the patch.
kernel void overwrite_region_patch_backward(global const REAL* output_gradient, global REAL* patch_gradient,
                                            const Region region, const int pixels) {
  const int p = get_global_id(0);
  if (p >= pixels) return;
  const int x = p % region.width, y = p / region.width % region.height, n = p / (region.width * region.height);
  const long from = ((long)n * region.image_height + region.top + y) * region.image_width + region.left + x;
  global REAL* target = patch_gradient + (long)p * region.channels;
  copy_run(output_gradient + from * region.image_channels + region.first_channel, target, region.used_channels);
  zero_run(target + region.used_channels, region.channels - region.used_channels);
}
