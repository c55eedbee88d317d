#include "host/ops/conv2d_winograd.h"

#include <algorithm>

namespace degas {
namespace {

constexpr int tile_side = 4, points = 36;
constexpr int most_tiles = 24;  // of an item: their points fill about half of a core's second cache

int64_t tiles_of_group(const GatherArguments& a) {
  return a.batch * ceiling(a.target_height, tile_side) * ceiling(a.target_width, tile_side);
}

/// Local memory for an item's points, of `channels` channels; a vector between the points of one tile, see the kernel.
LocalMemory memory_of_points(const Device& device, int tiles, int channels) {
  return {points * (size_t{1} * tiles * channels + device.vector_width()) * device.real_bytes()};
}

/// Tiles of 4 x 4 target pixels that an item takes; 0: there is no room for any.
int tiles_per_item(const Device& device, const GatherArguments& a, const GatherParameters& parameters) {
  const size_t room = device.description().local_bytes / 2;  // or the points would push all else out of the cache
  const int panel = parameters.vectors * device.vector_width(), block = parameters.pixels;
  const int wanted = static_cast<int>(std::min<int64_t>(most_tiles, tiles_of_group(a) / parameters.items));
  int tiles = std::max(block, wanted / block * block);
  while (tiles > 0 &&
         memory_of_points(device, tiles, a.depth()).bytes + memory_of_points(device, tiles, panel).bytes > room)
    tiles -= block;
  return tiles;
}

}  // namespace

bool winograd_allowed(const Device& device, const GatherArguments& a, const GatherParameters& parameters) {
  return device.is_wide() && parameters.fold == 1 && a.kernel_size.y == 3 && a.kernel_size.x == 3 &&
         a.source_step.y == 1 && a.source_step.x == 1 && a.target_step.y == 1 && a.target_step.x == 1 &&
         a.depth() % device.vector_width() == 0 && tiles_per_item(device, a, parameters) > 0;
}

GatherParameters winograd_parameters(const Device& device) {
  const bool few_registers = device.family() == DeviceFamily::NarrowCpu;
  return {.fold = 1, .kernel = GatherKernel::Winograd, .pixels = few_registers ? 6 : 8, .vectors = 1, .items = 16, .tiles_first = false};
}

bool winograd_pays(const Device& device, const GatherArguments& a) {
  // In vector operations, as measured on an AVX-512 core: a transform of a tile's points by a vector of channels, and
  // of the taps of one source channel by one.
  constexpr double transform = 700, weight_transform = 900;
  const double source_vectors = static_cast<double>(a.depth()) / device.vector_width();
  const auto target_vectors = static_cast<double>(ceiling(a.target_depth(), device.vector_width()));
  const double products = a.depth() * target_vectors;
  constexpr int saved = tile_side * tile_side * 9 - points;
  return static_cast<double>(tiles_of_group(a)) * (saved * products - transform * (source_vectors + target_vectors)) >
         weight_transform * products;
}

void gather_by_winograd(const Tensor& source, const Tensor& packed, const Tensor& bias, const Tensor& target,
                        double negative_slope, const GatherArguments& a, const GatherParameters& parameters,
                        int stream) {
  Device& device = source.device();
  const int panel = parameters.vectors * device.vector_width(), tiles = tiles_per_item(device, a, parameters);
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
      .launch({static_cast<size_t>(ceiling(tiles_of_group(a), tiles)), static_cast<size_t>(a.groups)}, {1, 1}, source,
              weight_points, bias, target, negative_slope, a, memory_of_points(device, tiles, a.depth()),
              memory_of_points(device, tiles, panel));
}

}  // namespace degas
