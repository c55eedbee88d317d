#include "host/ops/harmonics.h"

#include <fmt/format.h>

#include <stdexcept>

namespace degas {
namespace {

int degree_of(const Tensor& harmonics) {
  for (int degree = 1; degree <= largest_harmonic_degree; ++degree) {
    if (harmonics.dim(1) == harmonic_coefficients(degree)) return degree;
  }
  throw std::logic_error(fmt::format("[harmonics] {} coefficients a channel are of no degree of 1 to {}",
                                     harmonics.dim(1), largest_harmonic_degree));
}

}  // namespace

Tensor colors_seen_from(Tape& tape, const Eigen::Vector3d& camera, const Tensor& positions, const Tensor& rotations,
                        const Tensor& base_colors, const Tensor& harmonics) {
  const int count = static_cast<int>(positions.dim(0));
  if (positions.shape() != Shape{count, 3} || rotations.shape() != Shape{count, 4} ||
      base_colors.shape() != positions.shape() || harmonics.shape().size() != 3 || harmonics.dim(0) != count ||
      harmonics.dim(2) != 3) {
    throw std::logic_error(
        fmt::format("[harmonics] positions {}, rotations {}, colours {} and coefficients {} do not fit",
                    to_string(positions.shape()), to_string(rotations.shape()), to_string(base_colors.shape()),
                    to_string(harmonics.shape())));
  }
  const int degree = degree_of(harmonics);
  const auto launch = [=](Device& device, const char* name, const auto&... arguments) {
    device.kernel("harmonics", name, {{"DEGREE", degree}})
        .launch({static_cast<size_t>(count)}, {64}, arguments..., count);
  };
  Device& device = tape.device();
  const Tensor colors(device, {count, 3});
  launch(device, "colors_forward", positions, rotations, base_colors, harmonics, colors, camera.x(), camera.y(),
         camera.z());
  tape.record("colors_seen_from", {positions, rotations, base_colors, harmonics}, {colors}, [=](Tape& tape) {
    Device& device = tape.device();
    const Tensor d_colors = tape.gradient_or_zeros(colors);
    tape.accumulate(positions, [&](Tensor gradient) {
      launch(device, "positions_backward", d_colors, colors, positions, rotations, harmonics, gradient, camera.x(),
             camera.y(), camera.z());
    });
    tape.accumulate(rotations, [&](Tensor gradient) {
      launch(device, "rotations_backward", d_colors, colors, positions, rotations, harmonics, gradient, camera.x(),
             camera.y(), camera.z());
    });
    tape.accumulate(base_colors,
                    [&](Tensor gradient) { launch(device, "base_colors_backward", d_colors, colors, gradient); });
    tape.accumulate(harmonics, [&](Tensor gradient) {
      launch(device, "harmonics_backward", d_colors, colors, positions, rotations, gradient, camera.x(), camera.y(),
             camera.z());
    });
  });
  return colors;
}

}  // namespace degas
