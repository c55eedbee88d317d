// Bilinear enlargement to twice the height and width, corners aligned: output row i lies at i (H - 1) / (2H - 1) of the
// input. Forward and backward (a gather: each input pixel sums the outputs it took part in, in a fixed order).
// (The kernel is not called upsample: OpenCL C has a built-in function of that name.)
// Layout: input (N, H, W, C), output (N, 2H, 2W, C).
// -D CHANNEL_VECTOR=1|2|4|8|16: channels handled at once; must divide C.
// Launch of both: WIDE: (rows of the target, N), an item owns a row; otherwise (W C / CHANNEL_VECTOR, H, N) of the target.
#undef V
#define V CHANNEL_VECTOR
#include "common/real.cl"

// Where row i of the output lies between rows of the input, exact in integers.
#define SOURCE(i, size, low, fraction)               \
  const int low = (i) * ((size)-1) / (2 * (size)-1); \
  const REAL fraction = (REAL)((i) * ((size)-1) % (2 * (size)-1)) / (REAL)(2 * (size)-1)

// Input row s takes part in the outputs strictly between those that lie at s - 1 and s + 1: never more than 5.
#define MOST_TAPS 5
int first_output(const int s, const int size) { return s == 0 ? 0 : ((s - 1) * (2 * size - 1)) / (size - 1) + 1; }
int last_output(const int s, const int size) {
  return s >= size - 1 ? 2 * size - 1 : ((s + 1) * (2 * size - 1) - 1) / (size - 1);
}
// Its weights in those outputs; returns how many they are.
int tap_weights(const int s, const int first, const int size, REAL* weights) {
  const int taps = last_output(s, size) - first + 1;
  for (int tap = 0; tap < taps; ++tap) {
    const int distance = abs((first + tap) * (size - 1) - s * (2 * size - 1));
    weights[tap] = (REAL)(2 * size - 1 - distance) / (REAL)(2 * size - 1);
  }
  return taps;
}

void upsample_pixel(global const REAL* image, global REAL* target, const int y, const int x, const int first,
                    const int last, const int height, const int width, const int vectors) {
  SOURCE(y, height, top, down);
  SOURCE(x, width, left, right);
  const long row = (long)width * vectors;
  const long below = top + 1 < height ? row : 0, beside = left + 1 < width ? vectors : 0;
  const long corner = top * row + (long)left * vectors;
  for (int c = first; c < last; ++c) {
    const REALV a = LOAD_VECTOR(corner + c, image), b = LOAD_VECTOR(corner + beside + c, image);
    const REALV d = LOAD_VECTOR(corner + below + c, image), e = LOAD_VECTOR(corner + below + beside + c, image);
    const REALV upper = a + right * (b - a), lower = d + right * (e - d);
    STORE_VECTOR(upper + down * (lower - upper), c, target);
  }
}

void gather_pixel(global const REAL* gradient, global REAL* target, const REAL* row_weights, const int rows, const int top,
                  const int x, const int first, const int last, const int width, const int vectors) {
  REAL weights[MOST_TAPS];
  const int left = first_output(x, width);
  const int columns = tap_weights(x, left, width, weights);
  const long row = 2 * (long)width * vectors;
  for (int c = first; c < last; ++c) {
    REALV total = 0;
    for (int i = 0; i < rows; ++i) {
      REALV sums = 0;
      const long start = (top + i) * row + (long)left * vectors + c;
      for (int j = 0; j < columns; ++j) sums += weights[j] * LOAD_VECTOR(start + j * vectors, gradient);
      total += row_weights[i] * sums;
    }
    STORE_VECTOR(total, c, target);
  }
}

kernel void upsample_forward(global const REAL* input, global REAL* output, const int height, const int width, const int vectors) {
#if WIDE
  const int y = get_global_id(0), n = get_global_id(1);
  if (y >= 2 * height) return;
#else
  const int x = get_global_id(0) / vectors, c = get_global_id(0) % vectors, y = get_global_id(1), n = get_global_id(2);
  if (x >= 2 * width || y >= 2 * height) return;
#endif
  global const REAL* image = input + (long)n * height * width * vectors * V;
  global REAL* row = output + ((long)n * 2 * height + y) * 2 * width * vectors * V;
#if WIDE
  for (int x = 0; x < 2 * width; ++x) {
    upsample_pixel(image, row + (long)x * vectors * V, y, x, 0, vectors, height, width, vectors);
  }
#else
  upsample_pixel(image, row + (long)x * vectors * V, y, x, c, c + 1, height, width, vectors);
#endif
}

kernel void upsample_backward(global const REAL* output_gradient, global REAL* input_gradient, const int height,
                              const int width, const int vectors) {
#if WIDE
  const int y = get_global_id(0), n = get_global_id(1);
  if (y >= height) return;
#else
  const int x = get_global_id(0) / vectors, c = get_global_id(0) % vectors, y = get_global_id(1), n = get_global_id(2);
  if (x >= width || y >= height) return;
#endif
  global const REAL* gradient = output_gradient + (long)n * 4 * height * width * vectors * V;
  global REAL* row = input_gradient + ((long)n * height + y) * width * vectors * V;
  REAL row_weights[MOST_TAPS];
  const int top = first_output(y, height);
  const int rows = tap_weights(y, top, height, row_weights);
#if WIDE
  for (int x = 0; x < width; ++x) {
    gather_pixel(gradient, row + (long)x * vectors * V, row_weights, rows, top, x, 0, vectors, width, vectors);
  }
#else
  gather_pixel(gradient, row + (long)x * vectors * V, row_weights, rows, top, x, c, c + 1, width, vectors);
#endif
}
