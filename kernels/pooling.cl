// Maximum over WINDOW x WINDOW pixels (2 or 3) at stride 2 without padding; input (N,H,W,C), output (N,OutH,OutW,C). A
// last window may hang over the border (ceil mode); it then sees what exists. Of equal values the first in row order
// counts. `choice`: WINDOW dy + dx of the maximum, as REAL, of output's shape.
// Launch: forward one item per V channels of an output pixel, backward of an input pixel (gather); local size free.
// Deterministic: no element is written twice.
#include "common/real.cl"
#include "common/tail.cl"

kernel void max_pool(global const REAL* input, global REAL* output, global REAL* choice, const int height,
                     const int width, const int channels, const int out_height, const int out_width, const long items) {
  const long item = get_global_id(0);
  if (item >= items) return;
  const int vectors = (channels + V - 1) / V;
  const int channel = item % vectors * V, count = channels - channel;
  const long pixel = item / vectors;
  const int x = pixel % out_width, y = pixel / out_width % out_height;
  const long image = pixel / out_width / out_height;
  REALV best = 0, best_choice = 0;
  for (int dy = 0; dy < WINDOW && 2 * y + dy < height; ++dy) {
    for (int dx = 0; dx < WINDOW && 2 * x + dx < width; ++dx) {
      const long place = ((image * height + 2 * y + dy) * width + 2 * x + dx) * channels + channel;
      const REALV value = load_tail(input + place, count);
      if (dy + dx == 0) {
        best = value;
      } else {
        best_choice = value > best ? (REALV)(WINDOW * dy + dx) : best_choice;
        best = value > best ? value : best;
      }
    }
  }
  store_tail(best, output + pixel * channels + channel, count);
  if (choice) store_tail(best_choice, choice + pixel * channels + channel, count);
}

kernel void max_pool_gradient(global const REAL* output_gradient, global const REAL* choice, global REAL* gradient,
                              const int height, const int width, const int channels, const int out_height,
                              const int out_width, const long items) {
  const long item = get_global_id(0);
  if (item >= items) return;
  const int vectors = (channels + V - 1) / V;
  const int channel = item % vectors * V, count = channels - channel;
  const long pixel = item / vectors;
  const int x = pixel % width, y = pixel / width % height;
  const long image = pixel / width / height;
  REALV sum = 0;
  // Windows w with 2 w <= x < 2 w + WINDOW.
  for (int window_y = max(y - WINDOW + 2, 0) / 2; window_y <= min(y / 2, out_height - 1); ++window_y) {
    for (int window_x = max(x - WINDOW + 2, 0) / 2; window_x <= min(x / 2, out_width - 1); ++window_x) {
      const long place = ((image * out_height + window_y) * out_width + window_x) * channels + channel;
      const REALV here = WINDOW * (y - 2 * window_y) + x - 2 * window_x;
      sum += load_tail(choice + place, count) == here ? load_tail(output_gradient + place, count) : (REALV)0;
    }
  }
  store_tail(sum, gradient + pixel * channels + channel, count);
}
