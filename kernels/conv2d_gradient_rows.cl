// Gradient of a convolution with respect to its weights (see conv2d_gradient.cl) for narrow layers on CPUs. With few
// channels to a pixel there are too few sums to hide behind, so an item holds those of all taps of a kernel row.
//
// Of input and gradient one is read by vectors of channels and the other value by value, whichever leaves the fewest
// lanes idle; the equation is the same for both:
//
//   sum(ty, tx, k, c) = sum over y, x of values(y, x, k) * vectors(y * step + lead + ty, x * step + lead + tx, c)
//
// over all images and the positions of vectors that exist. Values from the gradient: step = stride and lead = -padding.
// Values from the input, for stride 1: lead = padding - (kernel - 1), and the taps come out turned by 180 degrees.
// -D TAPS: of a kernel row. -D ROWS: channels k that an item holds in registers.
#include "common/prefetch.cl"
#include "common/real.cl"
#include "common/tail.cl"

typedef struct {
  int batch, groups, kernel_height;
  int value_height, value_width, value_channels;  // channels of all groups
  int vector_height, vector_width, vector_channels;
  int step, lead;
  int units_per_item;   // (group, panel of V channels c, block of ROWS channels k, ty) an item does
  int lines_per_split;  // lines of values (of all images) summed into one partial result
  int lines_per_pass;   // lines summed in registers before the partial result is touched
} RowProducts;

// sum[t][r] += values[r] * vector[t]; rows after last_row repeat it.
__attribute__((always_inline)) inline void add_products(REALV sum[TAPS][ROWS], global const REAL* values,
                                                        const int last_row, const REALV vector[TAPS]) {
#pragma unroll
  for (int r = 0; r < ROWS; ++r) {
    const REALV value = (REALV)(values[min(r, last_row)]);
#pragma unroll
    for (int t = 0; t < TAPS; ++t) sum[t][r] = fma(value, vector[t], sum[t][r]);
  }
}

// partial (splits, groups, panels, kernel height, TAPS, channels k / group, V): each split's sums.
// Launch: (items over units, splits); local size {1, 1}.
kernel void weight_gradient_rows(global const REAL* values, global const REAL* vectors, global REAL* partial,
                                 const RowProducts s) {
  const int depth = s.value_channels / s.groups, vector_depth = s.vector_channels / s.groups;
  const int blocks = (depth + ROWS - 1) / ROWS, panels = (vector_depth + V - 1) / V;
  const int units = s.groups * panels * blocks * s.kernel_height;
  const int first_unit = (int)get_global_id(0) * s.units_per_item, end_unit = min(units, first_unit + s.units_per_item);
  const int split_begin = (int)get_global_id(1) * s.lines_per_split;
  const int split_end = min(split_begin + s.lines_per_split, s.batch * s.value_height);
  const long value_line = (long)s.value_width * s.value_channels;
  const long vector_line = (long)s.vector_width * s.vector_channels;
  global REAL* const results =
      partial + (long)get_global_id(1) * s.groups * panels * s.kernel_height * TAPS * depth * V;

  for (int pass = split_begin; pass < split_end; pass += s.lines_per_pass) {
    const int pass_end = min(pass + s.lines_per_pass, split_end);
    const int lines_ahead = min(s.lines_per_pass, split_end - pass_end);
    const int last_line = pass_end % s.value_height * s.step + s.lead + s.kernel_height - 1;
    global const REAL* const next_values = values + pass_end * value_line;
    global const REAL* const next_vectors =
        vectors + ((long)(pass_end / s.value_height) * s.vector_height + last_line) * vector_line;
    for (int unit = first_unit; unit < end_unit; ++unit) {
      // Each unit fetches its share of the lines that the next pass begins with: the first would wait for all of them.
      const int share = unit - first_unit, shares = end_unit - first_unit;
      for (long i = share * CACHE_LINE; i < lines_ahead * value_line; i += shares * CACHE_LINE)
        PREFETCH(next_values + i);
      for (long i = share * CACHE_LINE; i < lines_ahead * s.step * vector_line; i += shares * CACHE_LINE)
        PREFETCH(next_vectors + i);
      const int ty = unit % s.kernel_height, block = unit / s.kernel_height % blocks;
      const int panel_of_all = unit / s.kernel_height / blocks;
      const int group = panel_of_all / panels, panel = panel_of_all % panels;
      const int last_row = min(ROWS, depth - block * ROWS) - 1, lanes = vector_depth - panel * V;
      const int value_channel = group * depth + block * ROWS, vector_channel = group * vector_depth + panel * V;

      // Columns where every tap exists and no load leaves the array: those that reach over a pixel's channels do no
      // harm before the last pixels.
      const int value_excess = max(0, value_channel + ROWS - s.value_channels);
      const int vector_excess = max(0, vector_channel + V - s.vector_channels);
      const int value_columns = s.value_width - (value_excess + s.value_channels - 1) / s.value_channels;
      const int vector_columns = s.vector_width - (vector_excess + s.vector_channels - 1) / s.vector_channels;
      const int begin = min(s.value_width, max(0, (s.step - 1 - s.lead) / s.step));
      const int end = max(begin, min(value_columns, (vector_columns - TAPS - s.lead + s.step) / s.step));

      REALV sum[TAPS][ROWS];
#pragma unroll
      for (int t = 0; t < TAPS; ++t) {
#pragma unroll
        for (int r = 0; r < ROWS; ++r) sum[t][r] = 0;
      }
      for (int line = pass; line < pass_end; ++line) {
        const int image = line / s.value_height, y = (line - image * s.value_height) * s.step + s.lead + ty;
        if (y < 0 || y >= s.vector_height) continue;
        global const REAL* const value_at = values + line * value_line + value_channel;
        global const REAL* const vector_at =
            vectors + ((long)image * s.vector_height + y) * vector_line + s.lead * s.vector_channels + vector_channel;
        global const REAL* value = value_at + (long)begin * s.value_channels;
        global const REAL* vector = vector_at + (long)begin * s.step * s.vector_channels;
        for (int x = begin; x < end; ++x) {
          REALV tap[TAPS];
#pragma unroll
          for (int t = 0; t < TAPS; ++t) tap[t] = LOAD_VECTOR(0, vector + t * s.vector_channels);
          add_products(sum, value, ROWS - 1, tap);
          value += s.value_channels;
          vector += s.step * s.vector_channels;
        }
        for (int i = 0; i < s.value_width - (end - begin); ++i) {
          const int x = i < begin ? i : i + end - begin;
          REALV tap[TAPS];
#pragma unroll
          for (int t = 0; t < TAPS; ++t) {
            const int column = x * s.step + s.lead + t;
            tap[t] = 0;
            if (column >= 0 && column < s.vector_width)
              tap[t] = load_tail(vector_at + (long)(x * s.step + t) * s.vector_channels, lanes);
          }
          add_products(sum, value_at + (long)x * s.value_channels, last_row, tap);
        }
      }
      global REAL* result =
          results + (((long)panel_of_all * s.kernel_height + ty) * TAPS * depth + block * ROWS) * V;
#pragma unroll
      for (int t = 0; t < TAPS; ++t) {
#pragma unroll
        for (int r = 0; r < ROWS; ++r) {
          if (r <= last_row) {
            if (pass > split_begin) sum[t][r] += LOAD_VECTOR(t * depth + r, result);
            STORE_VECTOR(sum[t][r], t * depth + r, result);
          }
        }
      }
    }
  }
}

// weight_gradient (groups, taps, rows, columns) from partial. columns_are_vectors: whether c is a column, else a row;
// taps turned if it is.
// Launch: one item per element; local size free.
kernel void sum_products(global const REAL* partial, global REAL* weight_gradient, const int splits, const int groups,
                         const int taps, const int rows, const int columns, const int columns_are_vectors) {
  const int i = get_global_id(0);
  if (i >= groups * taps * rows * columns) return;
  const int column = i % columns, row = i / columns % rows, group = i / (columns * rows * taps);
  const int tap = i / (columns * rows) % taps, turned = columns_are_vectors ? taps - 1 - tap : tap;
  const int depth = columns_are_vectors ? rows : columns, k = columns_are_vectors ? row : column;
  const int vector_depth = columns_are_vectors ? columns : rows, c = columns_are_vectors ? column : row;
  const int panels = (vector_depth + V - 1) / V;
  const long at = ((((long)group * panels + c / V) * taps + turned) * depth + k) * V + c % V;
  REAL total = 0;
  for (int s = 0; s < splits; ++s) total += partial[at + (long)s * groups * panels * taps * depth * V];
  weight_gradient[i] = total;
}
