#include "host/ops/assembly.h"

#include <fmt/format.h>

#include <stdexcept>

namespace degas {
namespace {

template <typename... Arguments>
void launch(Device& device, const char* name, int count, const Arguments&... arguments) {
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
  const Tensor harmonics(tape.device(), {count, channels / 3, 3});
  launch(tape.device(), "gather_harmonics", count, map, texels, harmonics, channels);
  tape.record("gather_harmonics", {map}, {harmonics}, [=](Tape& tape) {
    tape.accumulate(map, [&](Tensor gradient) {
      gradient.fill_zero();
      launch(tape.device(), "gather_harmonics_backward", count, tape.gradient_or_zeros(harmonics), texels, gradient,
             channels);
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
  CanonicalGaussians output{Tensor(device, {count, 3}), Tensor(device, {count, 4}), Tensor(device, {count, 3}),
                                  Tensor(device, {count}),    Tensor(device, {count, 3}), Tensor(device, {count, 3}),
                                  Tensor(device, {count}),    {}};
  launch(device, "assemble_forward", count, maps.positions, maps.rotations_scales, maps.colors_opacities, base.texels,
         base.positions, base.rotations, base.log_scales, output.positions, output.rotations, output.log_scales,
         output.opacities, output.colors, output.offsets, output.opacity_logits, options.offset_scale,
         options.rotation_scale);
  tape.record("assemble", {maps.positions, maps.rotations_scales, maps.colors_opacities},
              {output.positions, output.rotations, output.log_scales, output.opacities, output.colors, output.offsets,
               output.opacity_logits},
              [=](Tape& tape) {
                Device& device = tape.device();
                tape.accumulate(maps.positions, [&](Tensor gradient) {
                  gradient.fill_zero();
                  launch(device, "assemble_positions_backward", count, tape.gradient_or_zeros(output.positions),
                         tape.gradient_or_zeros(output.offsets), base.texels, gradient, options.offset_scale);
                });
                tape.accumulate(maps.rotations_scales, [&](Tensor gradient) {
                  gradient.fill_zero();
                  launch(device, "assemble_rotations_backward", count, tape.gradient_or_zeros(output.rotations),
                         tape.gradient_or_zeros(output.log_scales), maps.rotations_scales, base.rotations, base.texels,
                         gradient, options.rotation_scale);
                });
                tape.accumulate(maps.colors_opacities, [&](Tensor gradient) {
                  gradient.fill_zero();
                  launch(device, "assemble_colors_backward", count, tape.gradient_or_zeros(output.colors),
                         tape.gradient_or_zeros(output.opacities), tape.gradient_or_zeros(output.opacity_logits),
                         output.colors, output.opacities, base.texels, gradient);
                });
              });
  if (maps.harmonics.defined()) {
    require(maps.harmonics, texels, maps.harmonics.dim(-1), "the harmonics map");
    output.harmonics = gather_harmonics(tape, maps.harmonics, base.texels);
  }
  return output;
}

}  // namespace degas
