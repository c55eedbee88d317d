#include "host/ops/harmonics.h"

#include <fmt/format.h>

#include <algorithm>
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

Tensor colors_seen_from(Tape& tape, const std::vector<Eigen::Vector3d>& cameras, const Tensor& positions,
                        const Tensor& rotations, const Tensor& base_colors, const Tensor& harmonics, int64_t room) {
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
  const int camera_count = static_cast<int>(cameras.size());
  const auto launch = [=](Device& device, const char* name, const auto&... arguments) {
    device.kernel("harmonics", name, {{"DEGREE", degree}})
        .launch({static_cast<size_t>(count)}, {64}, arguments..., camera_count, count);
  };
  Device& device = tape.device();
  const Tensor centers = Tensor::from(device, {camera_count, 3},
                                      std::span<const double>(cameras.front().data(), size_t{3} * camera_count));
  const Tensor colors(device, {std::max<int64_t>(camera_count, room), count, 3});
  launch(device, "colors_forward", positions, rotations, base_colors, harmonics, centers, colors);
  tape.record("colors_seen_from", {positions, rotations, base_colors, harmonics}, {colors},
              [=, base_colors = base_colors.without_values()](Tape& tape) {
                const auto like = [&](const Tensor& tensor) { return Tensor(tape.device(), tensor.shape()); };
                const Tensor d_positions = like(positions), d_rotations = like(rotations),
                             d_base_colors = like(base_colors), d_harmonics = like(harmonics);
                launch(tape.device(), "colors_backward", tape.gradient_or_zeros(colors), colors, positions, rotations,
                       harmonics, centers, d_positions, d_rotations, d_base_colors, d_harmonics);
                tape.accumulate(positions, d_positions);
                tape.accumulate(rotations, d_rotations);
                tape.accumulate(base_colors, d_base_colors);
                tape.accumulate(harmonics, d_harmonics);
              });
  return colors;
}

}  // namespace degas
