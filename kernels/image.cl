// Pictures for the losses: from bytes, cut out, resized. Images are (H,W,C) in 0..1.
// Launch: composite one item per pixel; crop*, resize* one item per element written; local size free.
// Deterministic: no element is written twice; gradients are gathered.
#include "common/real.cl"

// output = color / 255 + (1 - mask / 255) background; color (pixels, 3) already multiplied by mask (pixels)
kernel void composite(global const uchar* color, global const uchar* mask, global REAL* output, const REAL red,
                      const REAL green, const REAL blue, const long pixels) {
  const long pixel = get_global_id(0);
  if (pixel >= pixels) return;
  const REAL byte = 1 / (REAL)255;
  const REAL clear = 1 - byte * mask[pixel];
  output[3 * pixel] = byte * color[3 * pixel] + clear * red;
  output[3 * pixel + 1] = byte * color[3 * pixel + 1] + clear * green;
  output[3 * pixel + 2] = byte * color[3 * pixel + 2] + clear * blue;
}

// The rectangle of `image` (height, width, 3) that starts at (left, top); outside the image the given colour.
kernel void crop(global const REAL* image, global REAL* output, const int height, const int width, const int top,
                 const int left, const int out_width, const REAL red, const REAL green, const REAL blue,
                 const long count) {
  const long i = get_global_id(0);
  if (i >= count) return;
  const int channel = i % 3;
  const long y = i / 3 / out_width + top, x = i / 3 % out_width + left;
  const int inside = y >= 0 && y < height && x >= 0 && x < width;
  output[i] = inside ? image[(y * width + x) * 3 + channel] : channel == 0 ? red : channel == 1 ? green : blue;
}

kernel void crop_gradient(global const REAL* output_gradient, global REAL* gradient, const int width, const int top,
                          const int left, const int out_height, const int out_width, const long count) {
  const long i = get_global_id(0);
  if (i >= count) return;
  const int channel = i % 3;
  const long y = i / 3 / width - top, x = i / 3 % width - left;
  const int inside = y >= 0 && y < out_height && x >= 0 && x < out_width;
  gradient[i] = inside ? output_gradient[(y * out_width + x) * 3 + channel] : 0;
}

// Share of input sample `in` in output sample `out` along an axis of in_size and out_size samples. Shrinking: the
// overlap of the two intervals (area). Growing: linear between sample centres, the last sample beyond the border.
// Whole-number arithmetic up to the final division, so shares sum to 1; products of sizes must fit an int: sides up to
// 30,000.
REAL share(const int in, const int out, const int in_size, const int out_size) {
  if (out_size <= in_size) {
    const int overlap = min((out + 1) * in_size, (in + 1) * out_size) - max(out * in_size, in * out_size);
    return max(overlap, 0) / (REAL)in_size;
  }
  // Centre of the output sample: numerator / (2 out_size) input samples right of the first centre, at least -1/2.
  const int numerator = (2 * out + 1) * in_size - out_size;
  const int below = (numerator + 2 * out_size) / (2 * out_size) - 1;
  const REAL part = (numerator - below * 2 * out_size) / (REAL)(2 * out_size);
  return (max(below, 0) == in ? 1 - part : 0) + (min(below + 1, in_size - 1) == in ? part : 0);
}

// The input samples (x first, y last) that may have a share in output sample `out`; with the sizes swapped, the
// converse.
int2 samples_of(const int out, const int in_size, const int out_size, const int growing) {
  const int margin = growing ? 1 + in_size / out_size : 0;
  return (int2)(max(out * in_size / out_size - margin, 0),
                min(((out + 1) * in_size - 1) / out_size + margin, in_size - 1));
}

kernel void resize(global const REAL* image, global REAL* output, const int height, const int width,
                   const int out_height, const int out_width, const int channels, const long count) {
  const long i = get_global_id(0);
  if (i >= count) return;
  const int channel = i % channels;
  const int x = i / channels % out_width, y = i / channels / out_width;
  const int2 columns = samples_of(x, width, out_width, out_width > width);
  const int2 rows = samples_of(y, height, out_height, out_height > height);
  REAL sum = 0;
  for (int v = rows.x; v <= rows.y; ++v) {
    const REAL share_y = share(v, y, height, out_height);
    if (share_y == 0) continue;
    for (int u = columns.x; u <= columns.y; ++u) {
      const REAL share_x = share(u, x, width, out_width);
      if (share_x != 0) sum += share_y * share_x * image[((long)v * width + u) * channels + channel];
    }
  }
  output[i] = sum;
}

kernel void resize_gradient(global const REAL* output_gradient, global REAL* gradient, const int height,
                            const int width, const int out_height, const int out_width, const int channels,
                            const long count) {
  const long i = get_global_id(0);
  if (i >= count) return;
  const int channel = i % channels;
  const int x = i / channels % width, y = i / channels / width;
  const int2 columns = samples_of(x, out_width, width, out_width > width);
  const int2 rows = samples_of(y, out_height, height, out_height > height);
  REAL sum = 0;
  for (int v = rows.x; v <= rows.y; ++v) {
    const REAL share_y = share(y, v, height, out_height);
    if (share_y == 0) continue;
    for (int u = columns.x; u <= columns.y; ++u) {
      const REAL share_x = share(x, u, width, out_width);
      if (share_x != 0) sum += share_y * share_x * output_gradient[((long)v * out_width + u) * channels + channel];
    }
  }
  gradient[i] = sum;
}
