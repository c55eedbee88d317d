#include "host/ops/conv2d_parameters.h"

#include <algorithm>
#include <bit>
#include <initializer_list>
#include <iterator>

#include "host/ops/conv2d_winograd.h"

namespace degas {
namespace {

int floored(int a, int b) {
  return a >= 0 ? a / b : -static_cast<int>(ceiling(-a, b));
}

/// Whether conv2d_rows.cl runs what is folded already. Folded pixels that lie side by side are faster by conv2d.cl,
/// where a kernel row's taps are one run.
bool goes_by_rows(const Device& device, const GatherArguments& a) {
  constexpr int most_taps = 4, least_depth = 7, narrowest_line = 16;
  return device.family() == DeviceFamily::WideCpu && (a.fold == 1 || a.groups > 1) && a.target_step.y == 1 &&
         a.target_step.x == 1 && a.target_depth() <= device.vector_width() && a.depth() >= least_depth &&
         a.kernel_size.x <= most_taps && a.target_width >= narrowest_line;
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
  // All pixels of a fold lie in one panel.
  const int widest = device.family() == DeviceFamily::NarrowCpu ? vector : 2 * vector;
  for (int fold = 2; fold * a.target_channels <= widest; ++fold) {
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
constexpr Block rows_block = {16, 1};  // of conv2d_rows.cl

/// Register block of conv2d.cl on a GPU. Several channels an item, or it would load a number for every multiply-add.
Block gpu_block(DeviceFamily family) {
  switch (family) {
    case DeviceFamily::Nvidia:
    case DeviceFamily::Amd:
      return {8, 4};
    case DeviceFamily::Intel:
    case DeviceFamily::Mobile:
      return {4, 4};
    default:
      return {8, 1};
  }
}

/// Register block of conv2d.cl on a CPU for so many channels per group.
Block wide_block(const Device& device, int depth) {
  const int vector = device.vector_width();
  if (device.family() == DeviceFamily::NarrowCpu) return {6, 1};  // as twelve of its registers
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

/// Of conv2d.cl or conv2d_rows.cl.
GatherParameters sum_parameters(const Device& device, const GatherArguments& arguments) {
  GatherParameters result{};
  result.fold = best_fold(device, arguments);
  const GatherArguments a = result.fold > 1 ? folded(arguments, result.fold) : arguments;
  const bool by_rows = goes_by_rows(device, a);
  result.kernel = by_rows ? Conv2dKernel::Rows : Conv2dKernel::Sums;
  const Block block = !device.is_wide() ? gpu_block(device.family())
                      : by_rows         ? rows_block
                                        : wide_block(device, a.target_depth());
  result.pixels = block.pixels;
  result.vectors = block.vectors;
  // Enough work in an item to outweigh its start, enough items to keep every core busy.
  result.items = 64;
  // A CPU takes items in the order of axis 0: all panels of a tile while its pixels are in cache, or, where the weights
  // are the larger part, all tiles of a panel.
  const int64_t weights = int64_t{a.kernel_size.y} * arguments.kernel_size.x * a.depth() * arguments.target_channels;
  result.tiles_first =
      device.is_wide() && weights > int64_t{a.batch} * a.source_height * a.source_width * a.source_channels;
  return result;
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

/// Whether conv2d_gradient_rows.cl may run: its sums must fit the registers.
bool gradient_rows_allowed(const Device& device, const Conv2dGeometry& g) {
  constexpr int most_taps = 3;
  return device.family() == DeviceFamily::WideCpu && g.kernel_size <= most_taps;
}

int most_gradient_fold(const Device& device, const Conv2dGeometry& g) {
  return g.groups == 1 ? 2 * device.vector_width() / g.output_channels : 1;
}

/// Of conv2d_gradient.cl or conv2d_gradient_rows.cl.
WeightGradientParameters sum_gradient_parameters(const Device& device, const Conv2dGeometry& g) {
  if (!device.is_wide()) return {Conv2dKernel::Sums, false, 1, gpu_block(device.family()).vectors, 32};
  WeightGradientParameters result{Conv2dKernel::Sums, false, 1, 1};
  double least = gradient_cost(device, g, 1);
  const auto consider = [&](double cost, const WeightGradientParameters& candidate) {
    if (cost >= least) return;
    least = cost;
    result = candidate;
  };
  for (int fold = 2; fold <= most_gradient_fold(device, g); ++fold) {
    if (g.output_width % fold == 0) consider(gradient_cost(device, g, fold), {Conv2dKernel::Sums, false, fold, 1});
  }
  if (gradient_rows_allowed(device, g)) {
    if (g.stride == 1)
      consider(gradient_rows_cost(device, g, g.depth(), g.output_depth()), {Conv2dKernel::Rows, true, 1, 1});
    consider(gradient_rows_cost(device, g, g.output_depth(), g.depth()), {Conv2dKernel::Rows, false, 1, 1});
  }
  const bool room = device.family() == DeviceFamily::WideCpu;  // in the registers
  if (room && result.kernel == Conv2dKernel::Sums && result.fold * g.output_depth() > device.vector_width())
    result.vectors = 2;
  return result;
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

Tiles tiles_of(const Device& device, const GatherArguments& a, const GatherParameters& parameters) {
  const int64_t lines = int64_t{a.batch} * ceiling(a.target_height, a.target_step.y);
  const int64_t columns = ceiling(a.target_width, a.target_step.x);
  const int64_t tiles = parameters.kernel == Conv2dKernel::Rows ? lines * ceiling(columns, parameters.pixels)
                                                                : ceiling(lines * columns, parameters.pixels);
  return {tiles, device.is_wide() ? static_cast<int>(std::clamp<int64_t>(tiles / parameters.items, 1, 32)) : 1};
}

GatherParameters gather_parameters(const Device& device, const GatherArguments& arguments) {
  const GatherParameters winograd = winograd_parameters(device);
  if (winograd_allowed(device, arguments, winograd) && winograd_pays(device, arguments)) return winograd;
  return sum_parameters(device, arguments);
}

std::array<size_t, 2> gather_group(const Device& device, const GatherArguments& a, const GatherParameters& parameters) {
  if (device.is_wide()) return {1, 1};
  const bool small = device.family() == DeviceFamily::Mobile || device.family() == DeviceFamily::Intel;
  const size_t items = small ? 64 : 128;
  const auto panels =
      static_cast<size_t>(ceiling(a.target_depth(), parameters.vectors * device.vector_width()) * a.groups);
  // No wider than there are panels, or much of a work-group would idle.
  const size_t wide = std::min<size_t>(32, std::bit_ceil(panels));
  return {wide, items / wide};
}

std::vector<GatherParameters> gather_candidates(const Device& device, const GatherArguments& arguments) {
  // The built-in ones are tried in any case.
  const GatherParameters built_in = gather_parameters(device, arguments), usual = sum_parameters(device, arguments);
  std::vector<GatherParameters> result;
  const auto add = [&](GatherParameters candidate) {
    const GatherArguments a = candidate.fold > 1 ? folded(arguments, candidate.fold) : arguments;
    const bool one_panel = candidate.vectors * device.vector_width() >= a.target_depth();
    const bool legal = candidate.kernel == Conv2dKernel::Winograd ? winograd_allowed(device, a, candidate)
                       : candidate.kernel == Conv2dKernel::Rows   ? goes_by_rows(device, a)
                                                                  : candidate.fold == 1 || (a.groups == 1 && one_panel);
    if (legal && candidate != built_in && std::find(result.begin(), result.end(), candidate) == result.end())
      result.push_back(candidate);
  };
  const auto with_blocks = [&](const GatherParameters& from, std::initializer_list<Block> blocks) {
    for (const Block& block : blocks) {
      GatherParameters candidate = from;
      candidate.pixels = block.pixels;
      candidate.vectors = block.vectors;
      add(candidate);
    }
  };
  if (!device.is_wide()) {
    with_blocks(usual, {{8, 4}, {4, 4}, {8, 1}, {8, 2}, {16, 1}, {4, 1}, {16, 2}, {2, 4}});
    return result;
  }
  GatherParameters winograd = winograd_parameters(device);
  add(winograd);
  add(usual);
  winograd.items = 64;  // for many cores
  add(winograd);
  with_blocks(winograd_parameters(device), {{6, 2}, {12, 1}, {8, 2}, {4, 4}});
  GatherParameters other_order = usual, fewer_items = usual, more_items = usual, unfolded = usual, not_by_rows = usual;
  other_order.tiles_first = !usual.tiles_first;
  fewer_items.items = 16;
  more_items.items = 256;
  unfolded.fold = 1;
  unfolded.kernel = Conv2dKernel::Sums;
  not_by_rows.kernel = Conv2dKernel::Sums;
  add(other_order);
  add(fewer_items);
  with_blocks(not_by_rows, {{6, 2}, {8, 1}, {4, 3}, {4, 4}});
  if (usual.fold > 1) with_blocks(unfolded, {{8, 1}, {6, 2}});
  add(more_items);
  if (usual.kernel == Conv2dKernel::Rows) return result;
  for (const GatherParameters& from : {usual, other_order})
    with_blocks(from, {{6, 2}, {8, 1}, {4, 3}, {4, 4}, {12, 1}, {6, 1}, {7, 2}, {3, 4}, {5, 2}, {3, 2}});
  return result;
}

WeightGradientParameters weight_gradient_parameters(const Device& device, const Conv2dGeometry& g) {
  const WeightGradientParameters winograd = winograd_gradient_parameters(device, g);
  if (winograd_gradient_allowed(device, g, winograd) && winograd_gradient_pays(device, g)) return winograd;
  return sum_gradient_parameters(device, g);
}

std::vector<WeightGradientParameters> weight_gradient_candidates(const Device& device, const Conv2dGeometry& g) {
  // The built-in ones are tried in any case.
  const WeightGradientParameters built_in = weight_gradient_parameters(device, g),
                                 usual = sum_gradient_parameters(device, g);
  std::vector<WeightGradientParameters> result;
  const auto add = [&](const WeightGradientParameters& candidate) {
    if (candidate != built_in && std::find(result.begin(), result.end(), candidate) == result.end())
      result.push_back(candidate);
  };
  const auto add_sums = [&](WeightGradientParameters candidate) {
    for (const int items : {usual.items, usual.items / 2, 2 * usual.items, 4 * usual.items}) {
      for (const int pass_pixels : {128, 64, 256}) {
        candidate.items = items;
        candidate.pass_pixels = pass_pixels;
        add(candidate);
      }
    }
  };
  if (!device.is_wide()) {
    for (const int vectors : {4, 1, 2, usual.vectors}) add_sums({Conv2dKernel::Sums, false, 1, vectors});
    return result;
  }
  for (const int items : {16, 64}) {  // 64: for many cores
    WeightGradientParameters winograd = winograd_gradient_parameters(device, g);
    winograd.items = items;
    if (winograd_gradient_allowed(device, g, winograd)) add(winograd);
  }
  add(usual);
  for (const int vectors : {2, 1}) {
    add({Conv2dKernel::Sums, false, usual.fold, vectors});
    add({Conv2dKernel::Sums, false, 1, vectors});
  }
  if (gradient_rows_allowed(device, g)) {
    if (g.stride == 1) add({Conv2dKernel::Rows, true, 1, 1});
    add({Conv2dKernel::Rows, false, 1, 1});
  }
  add_sums(usual);
  return result;
}

}  // namespace degas
