// Gradients of a convolution (conv2d.cl) with respect to its weights and biases, NHWC, grouped. Sums over pixels are
// split into ranges of output rows whose results are then added in order: deterministic, no atomics.
// -D ROWS: input channels an item holds in registers. -D VECTORS: vectors of V output channels for each.
#include "common/prefetch.cl"
#include "common/real.cl"

#define PANEL (VECTORS * V)

typedef struct {
  int batch, height, width, channels;  // of the input, channels of all groups
  int output_height, output_width, output_channels;
  int groups, kernel_size, stride, padding;
  int units_per_item;  // (tap, block of ROWS input channels) pairs an item does
  int rows_per_split;  // output rows (of all images) summed into one partial result
  int rows_per_pass;   // output rows summed in registers before the partial result is touched
} WeightGradient;

// to += value, or = value the first time, in the first `lanes` of V elements
inline void add_lanes(REALV value, global REAL* to, int lanes, bool first_time) {
  if (lanes >= V) {
    if (!first_time) value += LOAD_VECTOR(0, to);
    STORE_VECTOR(value, 0, to);
    return;
  }
  REAL values[V];
  STORE_VECTOR(value, 0, values);
  for (int lane = 0; lane < lanes; ++lane) to[lane] = first_time ? values[lane] : to[lane] + values[lane];
}

// partial (splits, groups, kernel, kernel, channels / group, output channels / group): each split's weight gradient.
// gradient: of the output before its activation; V - 1 elements behind its end may be read, not used.
// Launch: (panels * groups, items over units, splits); local size free, {1, 1, 1} on CPUs.
kernel void weight_gradient(global const REAL* input, global const REAL* gradient, global REAL* partial,
                            const WeightGradient s) {
  const int depth = s.channels / s.groups, output_depth = s.output_channels / s.groups;
  const int panels = (output_depth + PANEL - 1) / PANEL, blocks = (depth + ROWS - 1) / ROWS;
  const int group = (int)get_global_id(0) / panels, panel = (int)get_global_id(0) % panels;
  const int split_begin = (int)get_global_id(2) * s.rows_per_split;
  const int split_end = min(split_begin + s.rows_per_split, s.batch * s.output_height);
  if (group >= s.groups || split_begin >= split_end) return;
  const int first_unit = (int)get_global_id(1) * s.units_per_item;
  const int end_unit = min(first_unit + s.units_per_item, s.kernel_size * s.kernel_size * blocks);
  const int lanes = output_depth - panel * PANEL;
  global const REAL* const gradients = gradient + group * output_depth + panel * PANEL;
  const long weights_of_group = (long)s.kernel_size * s.kernel_size * depth * output_depth;
  global REAL* const results =
      partial + ((long)get_global_id(2) * s.groups + group) * weights_of_group + panel * PANEL;

  for (int pass = split_begin; pass < split_end; pass += s.rows_per_pass) {
    const int pass_end = min(pass + s.rows_per_pass, split_end);
    // The next pass's first gradient row, and the last input row that it reads.
    const int next_y = min(pass_end % s.output_height * s.stride + s.kernel_size - 1 - s.padding, s.height - 1);
    global const REAL* const next_gradient = gradients + (long)pass_end * s.output_width * s.output_channels;
    global const REAL* const next_input =
        input + ((long)(pass_end / s.output_height) * s.height + next_y) * s.width * s.channels + group * depth;
    for (int unit = first_unit; unit < end_unit; ++unit) {
      const int kx = unit % s.kernel_size, block = unit / s.kernel_size % blocks, ky = unit / s.kernel_size / blocks;
      const int channel = block * ROWS, block_rows = min(ROWS, depth - channel);
      // Output columns whose tap lies inside the input.
      const int x_begin = max(0, (s.padding - kx + s.stride - 1) / s.stride);
      const int x_last = s.width - 1 + s.padding - kx;
      const int x_end = x_last < 0 ? 0 : min(s.output_width, x_last / s.stride + 1);

      // Each unit fetches its share of what the next pass needs: the first unit alone would wait for all of it.
      for (int x = unit - first_unit; x < s.output_width; x += end_unit - first_unit) {
#pragma unroll
        for (int v = 0; v < VECTORS; ++v) PREFETCH(next_gradient + (long)x * s.output_channels + v * V);
      }
      for (int x = unit - first_unit; x < s.width; x += end_unit - first_unit) {
        for (int k = 0; k < depth; k += CACHE_LINE) PREFETCH(next_input + (long)x * s.channels + k);
      }

      REALV sum[ROWS][VECTORS];
      int offset[ROWS];
#pragma unroll
      for (int r = 0; r < ROWS; ++r) {
        offset[r] = min(r, block_rows - 1);
#pragma unroll
        for (int v = 0; v < VECTORS; ++v) sum[r][v] = 0;
      }
      for (int row = pass; row < pass_end; ++row) {
        const int image = row / s.output_height;
        const int y = row % s.output_height * s.stride + ky - s.padding;
        if (y < 0 || y >= s.height) continue;
        const long corner = ((long)image * s.height + y) * s.width + x_begin * s.stride + kx - s.padding;
        global const REAL* from = input + corner * s.channels + group * depth + channel;
        global const REAL* gradient_at = gradients + ((long)row * s.output_width + x_begin) * s.output_channels;
        for (int x = x_begin; x < x_end; ++x) {
          REALV factor[VECTORS];
#pragma unroll
          for (int v = 0; v < VECTORS; ++v) factor[v] = LOAD_VECTOR(v, gradient_at);
#pragma unroll
          for (int r = 0; r < ROWS; ++r) {
#pragma unroll
            for (int v = 0; v < VECTORS; ++v) sum[r][v] = fma((REALV)(from[offset[r]]), factor[v], sum[r][v]);
          }
          from += s.stride * s.channels;
          gradient_at += s.output_channels;
        }
      }

#pragma unroll
      for (int r = 0; r < ROWS; ++r) {
        global REAL* result = results + ((long)(ky * s.kernel_size + kx) * depth + channel + r) * output_depth;
#pragma unroll
        for (int v = 0; v < VECTORS; ++v) {
          if (r < block_rows) add_lanes(sum[r][v], result + v * V, lanes - v * V, pass == split_begin);
        }
      }
    }
  }
}

// output[i] = sum over s of partial[s * count + i]
// Launch: one item per element; local size free.
kernel void sum_splits(global const REAL* partial, global REAL* output, const int splits, const long count) {
  const long i = get_global_id(0);
  if (i >= count) return;
  REAL total = 0;
  for (int s = 0; s < splits; ++s) total += partial[s * count + i];
  output[i] = total;
}

// partial[split, c] = sum over the split's pixels of gradient[pixel, c]
// Launch: (channels, splits); local size free.
kernel void channel_sums(global const REAL* gradient, global REAL* partial, const int channels, const long pixels,
                         const long pixels_per_split) {
  const int c = get_global_id(0);
  const long begin = get_global_id(1) * pixels_per_split;
  if (c >= channels || begin >= pixels) return;
  const long end = min(begin + pixels_per_split, pixels);
  REAL total = 0;
  for (long pixel = begin; pixel < end; ++pixel) total += gradient[pixel * channels + c];
  partial[get_global_id(1) * channels + c] = total;
}

// masked = gradient of the value before the leaky ReLU, told from the sign of its output
// Launch: one item per V elements; local size free.
kernel void activation_gradient(global const REAL* gradient, global const REAL* output, global REAL* masked,
                                const REAL negative_slope, const long count) {
  const long i = get_global_id(0);
  if (i * V >= count) return;
  const REALV g = LOAD_VECTOR(i, gradient);
  STORE_VECTOR(LOAD_VECTOR(i, output) > 0 ? g : g * negative_slope, i, masked);
}
