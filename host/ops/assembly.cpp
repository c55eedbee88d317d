#include "host/ops/assembly.h"

#include <fmt/format.h>

#include <stdexcept>

namespace degas {
namespace {

template <typename... Arguments>
void launch_assembly(Device& device, const char* name, int count, const Arguments&... arguments) {
  device.kernel("assembly", name).launch({static_cast<size_t>(count)}, {64}, arguments..., count);
}

void require(const Tensor& tensor, int64_t rows, int64_t columns, const char* name) {
  if (tensor.size() != rows * columns || (columns > 1 && tensor.dim(-1) != columns)) {
    throw std::logic_error(
        fmt::format("[assemble] {} must be ({},{}), got {}", name, rows, columns, to_string(tensor.shape())));
  }
}

/// (N,K,3) of a map of 3 K channels at the covered texels.
Tensor gather_harmonics(Tape& tape, const Tensor& map, const Tensor& texels) {
  const int count = static_cast<int>(texels.size()), channels = static_cast<int>(map.dim(-1));
  if (channels % 3 != 0) throw std::logic_error(fmt::format("[assemble] {} channels of harmonics", channels));
  const Tensor harmonics(tape.device(), {count, channels / 3, 3});
  launch_assembly(tape.device(), "gather_harmonics", count, map, texels, harmonics, channels);
  tape.record(
      "gather_harmonics", {map}, {harmonics},
      [map = map.without_values(), harmonics = harmonics.without_values(), texels, count, channels](Tape& tape) {
        tape.accumulate(map, [&](Tensor gradient) {
          gradient.fill_zero();
          launch_assembly(tape.device(), "gather_harmonics_backward", count, tape.gradient_or_zeros(harmonics), texels,
                          gradient, channels);
        });
      });
  return harmonics;
}

}  // namespace

CanonicalGaussians assemble(Tape& tape, const AssemblyMaps& maps, const GaussianBase& base,
                            const AssemblyOptions& options) {
  const int64_t texels = maps.positions.size() / 3;
  require(maps.positions, texels, 3, "the position map");
  require(maps.rotations_scales, texels, 7, "the rotation and scale map");
  require(maps.colors_opacities, texels, 4, "the colour and opacity map");
  const int count = static_cast<int>(base.texels.size());
  require(base.positions, count, 3, "base positions");
  require(base.rotations, count, 4, "base rotations");
  require(base.log_scales, count, 3, "base log-scales");

  Device& device = tape.device();
  CanonicalGaussians output{
      Tensor(device, {count, 3}), Tensor(device, {count, 4}), Tensor(device, {count, 3}), Tensor(device, {count}),
      Tensor(device, {count, 3}), Tensor(device, {count, 3}), Tensor(device, {count}),    {}};
  launch_assembly(device, "assemble_forward", count, maps.positions, maps.rotations_scales, maps.colors_opacities,
                  base.texels, base.positions, base.rotations, base.log_scales, output.positions, output.rotations,
                  output.log_scales, output.opacities, output.colors, output.offsets, output.opacity_logits,
                  options.offset_scale, options.rotation_scale);
  // What backward does not read is given back.
  const Tensor position_map = maps.positions.without_values(), color_map = maps.colors_opacities.without_values();
  CanonicalGaussians kept = output;
  for (Tensor* tensor : {&kept.positions, &kept.rotations, &kept.log_scales, &kept.offsets, &kept.opacity_logits}) {
    *tensor = tensor->without_values();
  }
  tape.record("assemble", {maps.positions, maps.rotations_scales, maps.colors_opacities},
              {output.positions, output.rotations, output.log_scales, output.opacities, output.colors, output.offsets,
               output.opacity_logits},
              [=, rotation_map = maps.rotations_scales](Tape& tape) {
                Device& device = tape.device();
                tape.accumulate(position_map, [&](Tensor gradient) {
                  gradient.fill_zero();
                  launch_assembly(device, "assemble_positions_backward", count, tape.gradient_or_zeros(kept.positions),
                                  tape.gradient_or_zeros(kept.offsets), base.texels, gradient, options.offset_scale);
                });
                tape.accumulate(rotation_map, [&](Tensor gradient) {
                  gradient.fill_zero();
                  launch_assembly(device, "assemble_rotations_backward", count, tape.gradient_or_zeros(kept.rotations),
                                  tape.gradient_or_zeros(kept.log_scales), rotation_map, base.rotations, base.texels,
                                  gradient, options.rotation_scale);
                });
                tape.accumulate(color_map, [&](Tensor gradient) {
                  gradient.fill_zero();
                  launch_assembly(device, "assemble_colors_backward", count, tape.gradient_or_zeros(kept.colors),
                                  tape.gradient_or_zeros(kept.opacities), tape.gradient_or_zeros(kept.opacity_logits),
                                  kept.colors, kept.opacities, base.texels, gradient);
                });
              });
  if (maps.harmonics.defined()) {
    require(maps.harmonics, texels, maps.harmonics.dim(-1), "the harmonics map");
    output.harmonics = gather_harmonics(tape, maps.harmonics, base.texels);
  }
  return output;
}

}  // namespace degas
