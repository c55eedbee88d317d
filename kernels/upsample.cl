// Bilinear enlargement to twice the height and width, corners aligned: output row i lies at i (H - 1) / (2H - 1) of the
// input. Forward, with an optional array that the result is added to, and backward (a gather: each input pixel sums the
// outputs it took part in, in a fixed order).
// (The kernel is not called upsample: OpenCL C has a built-in function of that name.)
// Layout: input (N, H, W, C), base (null: zeros) and output (N, 2H, 2W, C).
// -D CHANNEL_VECTOR=1|2|4|8|16: channels handled at once; must divide C.
// Launch of both: WIDE: (rows of the target, N), an item owns a row; otherwise (W C / CHANNEL_VECTOR, H, N) of the
// target.
#undef V
#define V CHANNEL_VECTOR
#include "common/real.cl"

// Where place i of the output's 2 size lies in the input, exact in integers: i (size - 1) / (2 size - 1) is
// k - k / (2 size - 1) for i = 2k and k + (size - 1 - k) / (2 size - 1) for i = 2k + 1.
int low_source(const int i, const int size) { return i % 2 ? i / 2 : max(i / 2 - 1, 0); }
REAL source_fraction(const int i, const int size) {
  const int k = i / 2;
  return (REAL)(i % 2 ? size - 1 - k : k > 0 ? 2 * size - 1 - k : 0) / (REAL)(2 * size - 1);
}

// The converse: place s of the input takes part in outputs 2s - 1 .. 2s + 2 with these weights, 0 beyond the ends.
#define TAPS 4
void tap_weights(const int s, const int size, REAL* weights) {
  const REAL last = 2 * size - 1;
  weights[0] = s > 0 ? (size - s) / last : 0;
  weights[1] = (2 * size - 1 - s) / last;
  weights[2] = (size + s) / last;
  weights[3] = s < size - 1 ? (s + 1) / last : 0;
}
int tap_place(const int s, const int tap, const int size) { return clamp(2 * s - 1 + tap, 0, 2 * size - 1); }

void upsample_pixel(global const REAL* image, global const REAL* base, global REAL* target, const int y, const int x,
                    const int first, const int last, const int height, const int width, const int vectors) {
  const int top = low_source(y, height), left = low_source(x, width);
  const REAL down = source_fraction(y, height), right = source_fraction(x, width);
  const long row = (long)width * vectors;
  const long below = top + 1 < height ? row : 0, beside = left + 1 < width ? vectors : 0;
  const long corner = top * row + (long)left * vectors;
  for (int c = first; c < last; ++c) {
    const REALV a = LOAD_VECTOR(corner + c, image), b = LOAD_VECTOR(corner + beside + c, image);
    const REALV d = LOAD_VECTOR(corner + below + c, image), e = LOAD_VECTOR(corner + below + beside + c, image);
    const REALV upper = a + right * (b - a), lower = d + right * (e - d), value = upper + down * (lower - upper);
    STORE_VECTOR(base ? LOAD_VECTOR(c, base) + value : value, c, target);
  }
}

// rows: where the rows of the taps begin.
void gather_pixel(global const REAL* gradient, global REAL* target, const REAL* row_weights, const long* rows,
                  const int x, const int first, const int last, const int width, const int vectors) {
  REAL weights[TAPS];
  tap_weights(x, width, weights);
  for (int c = first; c < last; ++c) {
    REALV total = 0;
    for (int i = 0; i < TAPS; ++i) {
      REALV sums = 0;
      for (int j = 0; j < TAPS; ++j) {
        sums += weights[j] * LOAD_VECTOR(rows[i] + (long)tap_place(x, j, width) * vectors + c, gradient);
      }
      total += row_weights[i] * sums;
    }
    STORE_VECTOR(total, c, target);
  }
}

kernel void upsample_forward(global const REAL* input, global const REAL* base, global REAL* output, const int height,
                             const int width, const int vectors) {
#if WIDE
  const int y = get_global_id(0), n = get_global_id(1);
  if (y >= 2 * height) return;
#else
  const int x = get_global_id(0) / vectors, c = get_global_id(0) % vectors, y = get_global_id(1), n = get_global_id(2);
  if (x >= 2 * width || y >= 2 * height) return;
#endif
  global const REAL* image = input + (long)n * height * width * vectors * V;
  const long row = ((long)n * 2 * height + y) * 2 * width * vectors * V;
#define PLACE(x) ((long)(x)*vectors * V)
#if WIDE
  for (int x = 0; x < 2 * width; ++x) {
    upsample_pixel(image, base ? base + row + PLACE(x) : 0, output + row + PLACE(x), y, x, 0, vectors, height, width,
                   vectors);
  }
#else
  upsample_pixel(image, base ? base + row + PLACE(x) : 0, output + row + PLACE(x), y, x, c, c + 1, height, width,
                 vectors);
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
  REAL row_weights[TAPS];
  long rows[TAPS];
  tap_weights(y, height, row_weights);
  for (int tap = 0; tap < TAPS; ++tap) rows[tap] = tap_place(y, tap, height) * 2 * (long)width * vectors;
#if WIDE
  for (int x = 0; x < width; ++x) {
    gather_pixel(gradient, row + PLACE(x), row_weights, rows, x, 0, vectors, width, vectors);
  }
#else
  gather_pixel(gradient, row + PLACE(x), row_weights, rows, x, c, c + 1, width, vectors);
#endif
}
