#include "host/ops/conv2d_winograd.h"

#include <algorithm>

namespace degas {
namespace {

constexpr int tile_side = 4, point_lines = 6, points = point_lines * point_lines;
constexpr int most_tiles = 24;  // of an item: their points fill about half of a core's second cache

int64_t tile_count(int batch, int height, int width) {
  return batch * ceiling(height, tile_side) * ceiling(width, tile_side);
}
int64_t tile_count(const GatherArguments& a) {
  return tile_count(a.batch, a.target_height, a.target_width);
}
int64_t tile_count(const Conv2dGeometry& g) {
  return tile_count(g.batch, g.output_height, g.output_width);
}

/// Local memory for an item's points; a vector between those of one tile, see the kernels.
LocalMemory memory_of_points(const Device& device, int lines, int tiles, int channels) {
  return {size_t{1} * lines * point_lines * (tiles * channels + device.vector_width()) * device.real_bytes()};
}

/// The most tiles, in whole blocks, up to `wanted` but at least a block, whose points of both numbers of channels have
/// room; 0: there is no room for a block.
int tiles_with_room(const Device& device, int lines, int wanted, int block, int channels, int other_channels) {
  const size_t room = device.description().local_bytes / 2;  // or the points would push all else out of the cache
  int tiles = std::max(1, wanted / block) * block;
  while (tiles > 0 && memory_of_points(device, lines, tiles, channels).bytes +
                              memory_of_points(device, lines, tiles, other_channels).bytes >
                          room)
    tiles -= block;
  return tiles;
}

/// Tiles of 4 x 4 target pixels that an item of conv2d_winograd.cl takes; 0: there is no room for any.
int gather_tiles(const Device& device, const GatherArguments& a, const GatherParameters& parameters) {
  const int wanted = static_cast<int>(std::min<int64_t>(most_tiles, tile_count(a) / parameters.items));
  return tiles_with_room(device, point_lines, wanted, parameters.pixels, a.depth(),
                         parameters.vectors * device.vector_width());
}

/// How conv2d_gradient_winograd.cl shares the work.
struct GradientShares {
  int lines;  ///< of points an item does
  int tiles;  ///< whose points it holds at once; 0: there is no room for any
  int tiles_per_split, splits;
};
GradientShares gradient_shares(const Device& device, const Conv2dGeometry& g, int items) {
  constexpr size_t room_for_sums = size_t{384} << 10;  // bytes, of a core's second cache
  const size_t sums_of_line = size_t{point_lines} * g.depth() * g.output_depth() * device.real_bytes();
  GradientShares shares{};
  for (const int lines : {6, 3, 2, 1}) {
    shares.lines = lines;
    if (lines * sums_of_line <= room_for_sums) break;
  }
  shares.tiles = tiles_with_room(device, shares.lines, most_tiles, 1, g.depth(), g.output_depth());
  const int64_t tiles = tile_count(g), wanted_splits = ceiling(items, g.groups * (point_lines / shares.lines));
  shares.tiles_per_split =
      static_cast<int>(std::max<int64_t>(ceiling(tiles, wanted_splits), std::min<int64_t>(most_tiles, tiles)));
  shares.splits = static_cast<int>(ceiling(tiles, shares.tiles_per_split));
  return shares;
}

/// Whether what Winograd's filtering saves is more than its transforms cost, in vector operations as measured on an
/// AVX-512 core: of a tile's points by a vector of channels, and of the taps of one input channel by one.
bool saves(const Device& device, int64_t tiles, int depth, int output_depth) {
  constexpr double transform = 700, weight_transform = 900;
  constexpr int saved = tile_side * tile_side * 9 - points;
  const double vectors = static_cast<double>(depth) / device.vector_width();
  const auto output_vectors = static_cast<double>(ceiling(output_depth, device.vector_width()));
  const double products = depth * output_vectors;
  return static_cast<double>(tiles) * (saved * products - transform * (vectors + output_vectors)) >
         weight_transform * products;
}

// Mirrors that of kernels/conv2d_gradient_winograd.cl.
struct WinogradGradientArguments {
  struct Plane {
    int height, width, channels;
  };
  Plane input, output;
  int batch, groups, padding, tiles_per_split;
};

}  // namespace

bool winograd_allowed(const Device& device, const GatherArguments& a, const GatherParameters& parameters) {
  return device.is_wide() && parameters.fold == 1 && a.kernel_size.y == 3 && a.kernel_size.x == 3 &&
         a.source_step.y == 1 && a.source_step.x == 1 && a.target_step.y == 1 && a.target_step.x == 1 &&
         a.depth() % device.vector_width() == 0 && gather_tiles(device, a, parameters) > 0;
}

GatherParameters winograd_parameters(const Device& device) {
  const bool few_registers = device.family() == DeviceFamily::NarrowCpu;
  return {.fold = 1,
          .kernel = Conv2dKernel::Winograd,
          .pixels = few_registers ? 6 : 8,
          .vectors = 1,
          .items = 16,
          .tiles_first = false};
}

bool winograd_pays(const Device& device, const GatherArguments& a) {
  return saves(device, tile_count(a), a.depth(), a.target_depth());
}

void gather_by_winograd(const Tensor& source, const Tensor& packed, const Tensor& bias, const Tensor& target,
                        double negative_slope, const GatherArguments& a, const GatherParameters& parameters,
                        int stream) {
  Device& device = source.device();
  const int panel = parameters.vectors * device.vector_width(), tiles = gather_tiles(device, a, parameters);
  const auto panels = static_cast<size_t>(a.groups * ceiling(a.target_depth(), panel));
  const auto kernel = [&](const char* name) {
    return device.kernel("conv2d_winograd", name,
                         {{"DEPTH", a.depth()},
                          {"TILES", tiles},
                          {"PIXELS", parameters.pixels},
                          {"VECTORS", parameters.vectors},
                          {"STREAM", stream}});
  };
  const Tensor weight_points(device, {static_cast<int64_t>(panels), points, a.depth(), panel});
  kernel("weights_to_points")
      .launch({static_cast<size_t>(parameters.vectors), static_cast<size_t>(a.depth()), panels},
              {static_cast<size_t>(parameters.vectors), 16, 1}, packed, weight_points, static_cast<int>(panels));
  kernel("gather_winograd")
      .launch({static_cast<size_t>(ceiling(tile_count(a), tiles)), static_cast<size_t>(a.groups)}, {1, 1}, source,
              weight_points, bias, target, negative_slope, a, memory_of_points(device, point_lines, tiles, a.depth()),
              memory_of_points(device, point_lines, tiles, panel));
}

bool winograd_gradient_allowed(const Device& device, const Conv2dGeometry& g,
                               const WeightGradientParameters& parameters) {
  const int vector = device.vector_width();
  return device.is_wide() && g.kernel_size == 3 && g.stride == 1 && g.depth() % vector == 0 &&
         g.output_depth() % (parameters.vectors * vector) == 0 &&
         gradient_shares(device, g, parameters.items).tiles > 0;
}

WeightGradientParameters winograd_gradient_parameters(const Device& device, const Conv2dGeometry& g) {
  const bool room = device.family() != DeviceFamily::NarrowCpu;  // in the registers
  return {.kernel = Conv2dKernel::Winograd,
          .vectors_are_outputs = true,
          .fold = 1,
          .vectors = room && g.output_depth() % (2 * device.vector_width()) == 0 ? 2 : 1};
}

bool winograd_gradient_pays(const Device& device, const Conv2dGeometry& g) {
  return saves(device, tile_count(g), g.depth(), g.output_depth());
}

void backward_weight_by_winograd(const Conv2dGeometry& g, const WeightGradientParameters& parameters,
                                 const Tensor& input, const Tensor& gradient, const Tensor& weight_gradient) {
  Device& device = input.device();
  const GradientShares shares = gradient_shares(device, g, parameters.items);
  const auto kernel = [&](const char* name) {
    return device.kernel("conv2d_gradient_winograd", name,
                         {{"DEPTH", g.depth()},
                          {"OUTPUT_DEPTH", g.output_depth()},
                          {"TILES", shares.tiles},
                          {"LINES", shares.lines},
                          {"ROWS", weight_gradient_rows},
                          {"VECTORS", parameters.vectors}});
  };
  const WinogradGradientArguments arguments{{g.height, g.width, g.channels},
                                            {g.output_height, g.output_width, g.output_channels},
                                            g.batch,
                                            g.groups,
                                            g.padding,
                                            shares.tiles_per_split};
  const Tensor partial(device, {shares.splits, g.groups, points, g.depth(), g.output_depth()});
  kernel("weight_gradient_winograd")
      .launch({static_cast<size_t>(point_lines / shares.lines), static_cast<size_t>(shares.splits),
               static_cast<size_t>(g.groups)},
              {1, 1, 1}, input, gradient, partial, arguments,
              memory_of_points(device, shares.lines, shares.tiles, g.depth()),
              memory_of_points(device, shares.lines, shares.tiles, g.output_depth()));
  kernel("points_to_weights")
      .launch({static_cast<size_t>(ceiling(g.output_depth(), device.vector_width())), static_cast<size_t>(g.depth()),
               static_cast<size_t>(g.groups)},
              {1, 16, 1}, partial, weight_gradient, shares.splits, g.groups);
}

}  // namespace degas
