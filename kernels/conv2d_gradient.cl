// Gradients of a convolution (conv2d.cl) with respect to its weights and biases, NHWC, grouped. Sums over pixels are
// split into ranges of output rows whose results are then added in order: deterministic, no atomics.
// Narrow layers are folded as in conv2d.cl: several pixels of a line as one with a wider kernel, whose gradient
// sum_folds brings back to the weight's own shape.
// -D ROWS: (tap of a kernel row, input channel) pairs an item holds in registers. -D VECTORS: vectors of V output
// channels for each.
#include "common/prefetch.cl"
#include "common/real.cl"
#include "common/tail.cl"

#define PANEL (VECTORS * V)

typedef struct {
  int batch, height, width, channels;  // of the input, channels of all groups
  int output_height, output_width, output_channels;  // folded, as is what follows
  int groups, kernel_height, kernel_width, stride_y, stride_x, padding;
  int units_per_item;  // (kernel row, tap unless those are merged, block of ROWS pairs) an item does
  int rows_per_split;  // output rows (of all images) summed into one partial result
  int rows_per_pass;   // output rows summed in registers before the partial result is touched
} WeightGradient;

// to += value, or = value the first time, in the first `lanes` of V elements
inline void add_lanes(REALV value, global REAL* to, const int lanes, const bool first_time) {
  if (lanes >= V) {
    if (!first_time) value += LOAD_VECTOR(0, to);
    STORE_VECTOR(value, 0, to);
  } else {
    if (!first_time) value += load_tail(to, lanes);
    store_tail(value, to, lanes);
  }
}

// The output columns for which this tap of a kernel row lies inside the input.
inline int first_column(const int tap, const WeightGradient s) {
  return max(0, (s.padding - tap + s.stride_x - 1) / s.stride_x);
}
inline int end_column(const int tap, const WeightGradient s) {
  return min(s.output_width, (s.width - 1 + s.padding - tap + s.stride_x) / s.stride_x);
}

// partial (splits, groups, kernel height, kernel width, channels / group, output channels / group): each split's weight
// gradient.
// gradient: of the output before its activation.
// Launch: (panels * groups, items over units, splits); local size free, {1, 1, 1} on CPUs.
kernel void weight_gradient(global const REAL* input, global const REAL* gradient, global REAL* partial,
                            const WeightGradient s) {
  const int depth = s.channels / s.groups, output_depth = s.output_channels / s.groups;
  // Without groups a kernel row's taps lie side by side: where a tap alone would not fill blocks, all of them do.
  const bool merged = s.groups == 1 && depth % ROWS != 0;
  const int pairs = merged ? s.kernel_width * depth : depth, taps = merged ? 1 : s.kernel_width;
  const int panels = (output_depth + PANEL - 1) / PANEL, blocks = (pairs + ROWS - 1) / ROWS;
  const int group = (int)get_global_id(0) / panels, panel = (int)get_global_id(0) % panels;
  const int split_begin = (int)get_global_id(2) * s.rows_per_split;
  const int split_end = min(split_begin + s.rows_per_split, s.batch * s.output_height);
  if (group >= s.groups || split_begin >= split_end) return;
  const int first_unit = (int)get_global_id(1) * s.units_per_item;
  const int end_unit = min(first_unit + s.units_per_item, s.kernel_height * taps * blocks);
  const int lanes = output_depth - panel * PANEL;
  global const REAL* const gradients = gradient + group * output_depth + panel * PANEL;
  // Where tap 0 of output column 0 reads.
  global const REAL* const inputs = input + group * depth - s.padding * s.channels;
  const long input_line = (long)s.width * s.channels;
  const long weights_of_group = (long)s.kernel_height * s.kernel_width * depth * output_depth;
  global REAL* const results =
      partial + ((long)get_global_id(2) * s.groups + group) * weights_of_group + panel * PANEL;

  for (int pass = split_begin; pass < split_end; pass += s.rows_per_pass) {
    const int pass_end = min(pass + s.rows_per_pass, split_end);
    // The next pass's first gradient row, and the last input row that it reads.
    const int next_y = min(pass_end % s.output_height * s.stride_y + s.kernel_height - 1 - s.padding, s.height - 1);
    global const REAL* const next_gradient = gradients + (long)pass_end * s.output_width * s.output_channels;
    global const REAL* const next_input =
        input + ((long)(pass_end / s.output_height) * s.height + next_y) * s.width * s.channels + group * depth;
    for (int unit = first_unit; unit < end_unit; ++unit) {
      const int kx = unit % taps, block = unit / taps % blocks, ky = unit / taps / blocks;
      const int first_pair = block * ROWS, block_pairs = min(ROWS, pairs - first_pair);
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
        offset[r] = min(r, block_pairs - 1);
#pragma unroll
        for (int v = 0; v < VECTORS; ++v) sum[r][v] = 0;
      }
      // Output columns where any pair's tap lies inside the input, and those where all do.
      const int first_tap = merged ? first_pair / depth : kx;
      const int last_tap = merged ? (first_pair + block_pairs - 1) / depth : kx;
      const int any_begin = first_column(last_tap, s), any_end = max(any_begin, end_column(first_tap, s));
      const int all_begin = merged ? min(first_column(first_tap, s), any_end) : any_begin;
      // A load that reaches into the next pixels does no harm, but must not leave the array.
      const int excess = max(0, group * output_depth + (panel + 1) * PANEL - s.output_channels);
      const int whole = s.output_width - (excess + s.output_channels - 1) / s.output_channels;
      const int all_end = max(all_begin, min(whole, merged ? end_column(last_tap, s) : any_end));
      const int step = s.stride_x * s.channels;
      global REAL* const result = results + ((long)(ky * taps + kx) * pairs + first_pair) * output_depth;
      global const REAL* const first_input = inputs + kx * s.channels + first_pair;
      for (int row = pass; row < pass_end; ++row) {
        const int y = row % s.output_height * s.stride_y + ky - s.padding;
        if (y < 0 || y >= s.height) continue;
        global const REAL* from =
            first_input + ((long)(row / s.output_height) * s.height + y) * input_line + (long)all_begin * step;
        global const REAL* gradient_at = gradients + ((long)row * s.output_width + all_begin) * s.output_channels;
        for (int x = all_begin; x < all_end; ++x) {
          REALV factor[VECTORS];
#pragma unroll
          for (int v = 0; v < VECTORS; ++v) factor[v] = LOAD_VECTOR(v, gradient_at);
#pragma unroll
          for (int r = 0; r < ROWS; ++r) {
#pragma unroll
            for (int v = 0; v < VECTORS; ++v) sum[r][v] = fma((REALV)(from[offset[r]]), factor[v], sum[r][v]);
          }
          from += step;
          gradient_at += s.output_channels;
        }
      }
#pragma unroll
      for (int r = 0; r < ROWS; ++r) {
#pragma unroll
        for (int v = 0; v < VECTORS; ++v) {
          if (r < block_pairs && v * V < lanes)
            add_lanes(sum[r][v], result + r * output_depth + v * V, lanes - v * V, pass == split_begin);
        }
      }
      const int border = any_end - any_begin - (all_end - all_begin);
      for (int r = 0; r < block_pairs && border > 0; ++r) {
        const int tap = kx + (first_pair + r) / depth;
        for (int v = 0; v * V < lanes && v < VECTORS; ++v) {
          REALV value = load_tail(result + r * output_depth + v * V, lanes - v * V);
          for (int row = pass; row < pass_end; ++row) {
            const int y = row % s.output_height * s.stride_y + ky - s.padding;
            if (y < 0 || y >= s.height) continue;
            global const REAL* from = first_input + ((long)(row / s.output_height) * s.height + y) * input_line + r;
            for (int i = 0; i < border; ++i) {
              const int x = any_begin + i < all_begin ? any_begin + i : any_begin + i + all_end - all_begin;
              const int source_x = x * s.stride_x + tap - s.padding;
              global const REAL* gradient_at = gradients + ((long)row * s.output_width + x) * s.output_channels + v * V;
              if (source_x >= 0 && source_x < s.width)
                value = fma((REALV)(from[(long)x * step]), load_tail(gradient_at, lanes - v * V), value);
            }
          }
          store_tail(value, result + r * output_depth + v * V, lanes - v * V);
        }
      }
    }
  }
}

// output (kernel, kernel, channels, output channels) from partial (splits, kernel, folded kernel, channels, fold *
// output channels): tap x of pixel p of a fold is tap p * stride + x of the folded kernel.
// Launch: one item per element; local size free.
kernel void sum_folds(global const REAL* partial, global REAL* output, const int splits, const int fold,
                      const int kernel_size, const int stride, const int channels, const int output_channels) {
  const int i = get_global_id(0);
  if (i >= kernel_size * kernel_size * channels * output_channels) return;
  const int c = i % output_channels, k = i / output_channels % channels;
  const int x = i / (output_channels * channels) % kernel_size, y = i / (output_channels * channels * kernel_size);
  const int folded_kernel = (fold - 1) * stride + kernel_size;
  REAL total = 0;
  for (int s = 0; s < splits; ++s) {
    for (int p = 0; p < fold; ++p) {
      const long tap = ((long)s * kernel_size + y) * folded_kernel + p * stride + x;
      total += partial[((tap * channels + k) * fold + p) * output_channels + c];
    }
  }
  output[i] = total;
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
