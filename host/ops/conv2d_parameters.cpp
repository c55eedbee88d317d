#include "host/ops/conv2d_parameters.h"

#include <algorithm>
#include <iterator>

namespace degas {
namespace {

int floored(int a, int b) {
  return a >= 0 ? a / b : -static_cast<int>(ceiling(-a, b));
}

/// Whether conv2d_rows.cl runs what is folded already. Folded pixels that lie side by side are faster by conv2d.cl,
/// where a kernel row's taps are one run.
bool goes_by_rows(const Device& device, const GatherArguments& a) {
  constexpr int most_taps = 4, least_depth = 7, narrowest_line = 16;
  return device.is_wide() && (a.fold == 1 || a.groups > 1) && a.target_step.y == 1 && a.target_step.x == 1 &&
         a.target_depth() <= device.vector_width() && a.depth() >= least_depth && a.kernel_size.x <= most_taps &&
         a.target_width >= narrowest_line;
}

/// How many pixels to fold so that the fewest vector operations are spent on each; 1: none.
int best_fold(const Device& device, const GatherArguments& a) {
  if (!device.is_wide()) return 1;
  const int vector = device.vector_width();
  if (a.groups > 1) {
    // Channels of neighbouring pixels do not lie side by side: only halves of a vector are put together.
    const bool fits = a.target_width % 2 == 0 && 2 * a.target_depth() == vector;
    return fits && goes_by_rows(device, folded(a, 2)) ? 2 : 1;
  }
  const auto cost = [&](const GatherArguments& arguments, int fold) {
    constexpr double start_of_pixel = 8;  // its addresses, bias, activation and store, measured in multiply-adds
    const double taps = static_cast<double>(arguments.kernel_size.x) / arguments.target_step.x *
                        arguments.kernel_size.y / arguments.target_step.y;
    return static_cast<double>(ceiling(arguments.target_channels, vector)) *
           (taps * arguments.source_channels + start_of_pixel) / fold;
  };
  int best = 1;
  double least = cost(a, 1);
  for (int fold = 2; fold * a.target_channels <= 2 * vector; ++fold) {
    if (a.target_width % fold != 0 || fold % a.target_step.x != 0) continue;
    const double with_fold = cost(folded(a, fold), fold);
    if (with_fold >= least) continue;
    least = with_fold;
    best = fold;
  }
  return best;
}

struct Block {
  int pixels, vectors;
};

/// Register block of conv2d.cl on a CPU for so many channels per group.
Block wide_block(int vector, int depth) {
  // Up to sixteen sums fit; the fewest idle lanes win, and of equal ones the block with the fewest loads.
  constexpr Block blocks[] = {{4, 4}, {4, 3}, {6, 2}, {8, 1}};
  return *std::min_element(std::begin(blocks), std::end(blocks), [&](const Block& a, const Block& b) {
    const auto cost = [&](const Block& block) {
      const int panel = block.vectors * vector;
      return static_cast<double>(ceiling(depth, panel) * panel) * (block.vectors == 1 ? 1.1 : 1);
    };
    return cost(a) < cost(b);
  });
}

/// Vector operations of conv2d_gradient.cl for each output pixel and kernel row, with `fold` pixels as one.
double gradient_cost(const Device& device, const Conv2dGeometry& g, int fold) {
  const int64_t vectors = ceiling(fold * g.output_depth(), device.vector_width());
  const int kernel_width = (fold - 1) * g.stride + g.kernel_size;
  const int64_t blocks = g.groups == 1 ? ceiling(kernel_width * g.depth(), weight_gradient_rows)
                                       : kernel_width * ceiling(g.depth(), weight_gradient_rows);
  constexpr double single_vector = 1.4;  // too few sums to hide the multiply-adds' latency, measured
  return static_cast<double>(g.groups * vectors * blocks * weight_gradient_rows) * (vectors == 1 ? single_vector : 1) /
         fold;
}

/// The same of conv2d_gradient_rows.cl.
double gradient_rows_cost(const Device& device, const Conv2dGeometry& g, int values, int vectors) {
  return static_cast<double>(g.groups * g.kernel_size * ceiling(vectors, device.vector_width()) *
                             ceiling(values, weight_gradient_rows_by_rows) * weight_gradient_rows_by_rows);
}

}  // namespace

GatherArguments folded(GatherArguments a, int fold) {
  const int source_step = a.source_step.x, target_step = a.target_step.x, lead = a.lead.x;
  const int last_tap = (fold - 1) * source_step + a.kernel_size.x - 1;  // of the last pixel, counted from the first's
  a.fold = fold;
  a.target_width /= fold;
  a.target_channels *= fold;
  a.lead.x = -floored(-lead, target_step);
  a.kernel_size.x = floored(lead + last_tap, target_step) - a.lead.x + 1;
  a.source_step.x = fold * source_step / target_step;
  a.target_step.x = 1;
  return a;
}

GatherParameters gather_parameters(const Device& device, const GatherArguments& arguments) {
  GatherParameters result{};
  result.fold = best_fold(device, arguments);
  const GatherArguments a = result.fold > 1 ? folded(arguments, result.fold) : arguments;
  result.by_rows = goes_by_rows(device, a);
  result.halves = result.fold > 1 && a.groups > 1;
  const Block block = !device.is_wide()  ? Block{8, 1}
                      : result.by_rows ? Block{16, 1}
                                       : wide_block(device.vector_width(), a.target_depth());
  result.pixels = block.pixels;
  result.vectors = block.vectors;
  const int64_t lines = int64_t{a.batch} * ceiling(a.target_height, a.target_step.y);
  const int64_t columns = ceiling(a.target_width, a.target_step.x);
  result.tiles = result.by_rows ? lines * ceiling(columns, block.pixels) : ceiling(lines * columns, block.pixels);
  // Enough work in an item to outweigh its start, enough items to keep every core busy.
  result.tiles_per_item = device.is_wide() ? static_cast<int>(std::clamp<int64_t>(result.tiles / 64, 1, 32)) : 1;
  // A CPU takes items in the order of axis 0: all panels of a tile while its pixels are in cache, or, where the weights
  // are the larger part, all tiles of a panel.
  const int64_t weights = int64_t{a.kernel_size.y} * arguments.kernel_size.x * a.depth() * arguments.target_channels;
  result.tiles_first =
      device.is_wide() && weights > int64_t{a.batch} * a.source_height * a.source_width * a.source_channels;
  return result;
}

WeightGradientParameters weight_gradient_parameters(const Device& device, const Conv2dGeometry& g) {
  if (!device.is_wide()) return {false, false, 1, 1};
  WeightGradientParameters result{false, false, 1, 1};
  double least = gradient_cost(device, g, 1);
  const auto consider = [&](double cost, const WeightGradientParameters& candidate) {
    if (cost >= least) return;
    least = cost;
    result = candidate;
  };
  for (int fold = 2; g.groups == 1 && fold * g.output_channels <= 2 * device.vector_width(); ++fold) {
    if (g.output_width % fold == 0) consider(gradient_cost(device, g, fold), {false, false, fold, 1});
  }
  constexpr int most_taps = 3;  // whose sums fit the registers
  if (g.kernel_size <= most_taps) {
    if (g.stride == 1) consider(gradient_rows_cost(device, g, g.depth(), g.output_depth()), {true, true, 1, 1});
    consider(gradient_rows_cost(device, g, g.output_depth(), g.depth()), {true, false, 1, 1});
  }
  if (!result.by_rows && result.fold * g.output_depth() > device.vector_width()) result.vectors = 2;
  return result;
}

}  // namespace degas
