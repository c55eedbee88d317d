#include "host/ops/conv2d_tuning.h"

#include <fmt/format.h>

#include <bit>

#include "host/device/tuner.h"

namespace degas {
namespace {

/// Parameters as the tuner keeps them, to and fro.
Parameters named(const GatherParameters& p) {
  return {{"fold", p.fold},   {"kernel", static_cast<int>(p.kernel)}, {"pixels", p.pixels}, {"vectors", p.vectors},
          {"items", p.items}, {"tiles_first", p.tiles_first}};
}
void read(const Parameters& from, GatherParameters& p) {
  p.fold = from.at("fold");
  p.kernel = static_cast<Conv2dKernel>(from.at("kernel"));
  p.pixels = from.at("pixels");
  p.vectors = from.at("vectors");
  p.items = from.at("items");
  p.tiles_first = from.at("tiles_first");
}
Parameters named(const WeightGradientParameters& p) {
  return {{"kernel", static_cast<int>(p.kernel)},
          {"vectors_are_outputs", p.vectors_are_outputs},
          {"fold", p.fold},
          {"vectors", p.vectors},
          {"items", p.items},
          {"pass_pixels", p.pass_pixels}};
}
void read(const Parameters& from, WeightGradientParameters& p) {
  p.kernel = static_cast<Conv2dKernel>(from.at("kernel"));
  p.vectors_are_outputs = from.at("vectors_are_outputs");
  p.fold = from.at("fold");
  p.vectors = from.at("vectors");
  p.items = from.at("items");
  p.pass_pixels = from.at("pass_pixels");
}

/// Uniform numbers in -1 .. 1, the same for the same seed.
Tensor invented_numbers(Device& device, const Shape& shape, uint32_t seed) {
  std::vector<float> values(element_count(shape));
  for (float& value : values) {
    seed = seed * 1664525u + 1013904223u;
    value = static_cast<float>(static_cast<int32_t>(seed)) * 0x1p-31f;
  }
  return Tensor::from(device, shape, std::span<const float>(values));
}

/// Of `usual` and the others, what the tuner chooses. launch: writes a target of the given shape from two inputs.
template <typename Choice>
Choice choose(Device& device, const TunedKernel& kernel, const std::string& shape, const Choice& usual,
              const std::function<std::vector<Choice>()>& others, const std::array<Shape, 3>& shapes,
              const std::function<void(const Tensor&, const Tensor&, const Tensor&, const Choice&)>& launch) {
  Choice result = usual;
  read(device.tuner()->choose(kernel, shape,
                              [&] {
                                Tunable tunable;
                                tunable.candidates.push_back(named(usual));
                                for (const Choice& other : others()) tunable.candidates.push_back(named(other));
                                tunable.prepare = [&] {
                                  const Tensor first = invented_numbers(device, shapes[0], 1),
                                               second = invented_numbers(device, shapes[1], 2),
                                               target(device, shapes[2]);
                                  return Trial{&target.memory(), target.size(), [=](const Parameters& parameters) {
                                                 Choice choice = usual;
                                                 read(parameters, choice);
                                                 launch(first, second, target, choice);
                                               }};
                                };
                                return tunable;
                              }),
       result);
  return result;
}

int magnitude(int64_t count) {
  return std::bit_width(static_cast<uint64_t>(count));
}

}  // namespace

GatherParameters tuned_gather_parameters(Device& device, const GatherArguments& a, const Shape& weight,
                                         const GatherLaunch& launch) {
  const GatherParameters usual = gather_parameters(device, a);
  if (!device.tuner()) return usual;
  // With what the candidates depend on: which folds and kernels are legal.
  const std::string shape =
      fmt::format("channels {}->{} groups {} kernel {}x{} step {} of {} lead {} pixels 2^{} fold {} kernel {}{}",
                  a.source_channels, a.target_channels, a.groups, a.kernel_size.y, a.kernel_size.x, a.source_step.y,
                  a.target_step.y, a.lead.y, magnitude(int64_t{a.batch} * a.target_height * a.target_width), usual.fold,
                  static_cast<int>(usual.kernel), usual.tiles_first ? " small" : "");
  return choose<GatherParameters>(
      device, {"conv2d/gather", {"conv2d", "conv2d_rows", "conv2d_winograd", "conv2d_packing"}}, shape, usual,
      [&] { return gather_candidates(device, a); },
      {Shape{a.batch, a.source_height, a.source_width, a.source_channels}, weight,
       Shape{a.batch, a.target_height, a.target_width, a.target_channels}},
      launch);
}

WeightGradientParameters tuned_weight_gradient_parameters(Device& device, const Conv2dGeometry& g,
                                                          const WeightGradientLaunch& launch) {
  const WeightGradientParameters usual = weight_gradient_parameters(device, g);
  if (!device.tuner()) return usual;
  const std::string shape = fmt::format("channels {}->{} groups {} kernel {} stride {} padding {} pixels 2^{} fold {}",
                                        g.channels, g.output_channels, g.groups, g.kernel_size, g.stride, g.padding,
                                        magnitude(g.output_pixels()), usual.fold);
  return choose<WeightGradientParameters>(
      device,
      {"conv2d_gradient/weight_gradient", {"conv2d_gradient", "conv2d_gradient_rows", "conv2d_gradient_winograd"}},
      shape, usual, [&] { return weight_gradient_candidates(device, g); },
      {Shape{g.batch, g.height, g.width, g.channels}, g.output_shape(),
       Shape{g.groups, g.kernel_size, g.kernel_size, g.depth(), g.output_depth()}},
      launch);
}

}  // namespace degas
