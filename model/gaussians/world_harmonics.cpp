#include "model/gaussians/world_harmonics.h"

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "host/ops/harmonics.h"
#include "host/ops/pointwise.h"

namespace degas {
namespace {

/// Evenly spread unit directions (Fibonacci's spiral).
std::vector<Eigen::Vector3f> spread_directions(int count) {
  std::vector<Eigen::Vector3f> directions;
  for (int m = 0; m < count; ++m) {
    const double z = 1 - (2 * m + 1.0) / count, radius = std::sqrt(1 - z * z);
    const double turn = 2 * std::numbers::pi * m / std::numbers::phi;
    directions.emplace_back(Eigen::Vector3d(radius * std::cos(turn), radius * std::sin(turn), z).cast<float>());
  }
  return directions;
}

/// (N,3): the harmonics' part of the colours of Gaussians seen in `directions` (N,3). The operator holds colours at 0,
/// so the negative half is seen through the harmonics' negative.
std::vector<float> harmonics_seen(Tape& tape, const Tensor& directions, const Tensor& rotations,
                                  const Tensor& harmonics) {
  const Tensor black = Tensor::zeros(tape.device(), directions.shape());
  const auto seen = [&](const Tensor& signed_harmonics) {
    return colors_seen_from(tape, {Eigen::Vector3d::Zero()}, directions, rotations, black, signed_harmonics)
        .to_host<float>();
  };
  std::vector<float> colors = seen(harmonics);
  const std::vector<float> negative = seen(scale(tape, harmonics, -1));
  for (size_t i = 0; i < colors.size(); ++i) colors[i] -= negative[i];
  return colors;
}

/// (directions, coefficients): every harmonic in every direction, in the world's axes.
Eigen::MatrixXd world_basis(Tape& tape, const std::vector<Eigen::Vector3f>& directions, int64_t coefficients) {
  Device& device = tape.device();
  const auto count = static_cast<int64_t>(directions.size());
  const Tensor points = Tensor::from(device, {count, 3}, std::span<const float>(directions.front().data(), 3 * count));
  std::vector<float> upright(4 * count, 0.0F);
  for (int64_t m = 0; m < count; ++m) upright[4 * m] = 1;
  const Tensor rotations = Tensor::from(device, {count, 4}, std::span<const float>(upright));
  Eigen::MatrixXd basis(count, coefficients);
  for (int64_t j = 0; j < coefficients; ++j) {
    std::vector<float> one(count * coefficients * 3, 0.0F);
    for (int64_t m = 0; m < count; ++m) one[(m * coefficients + j) * 3] = 1;
    const Tensor harmonics = Tensor::from(device, {count, coefficients, 3}, std::span<const float>(one));
    const std::vector<float> seen = harmonics_seen(tape, points, rotations, harmonics);
    for (int64_t m = 0; m < count; ++m) basis(m, j) = seen[3 * m];
  }
  return basis;
}

}  // namespace

std::vector<float> world_harmonics(Tape& tape, const Splats& splats) {
  const int64_t count = splats.positions.dim(0), coefficients = splats.harmonics.dim(1);
  const std::vector<Eigen::Vector3f> directions = spread_directions(static_cast<int>(2 * coefficients + 2));
  const Eigen::MatrixXd fit =
      world_basis(tape, directions, coefficients).completeOrthogonalDecomposition().pseudoInverse();
  std::vector<double> sums(count * coefficients * 3, 0.0);
  for (size_t m = 0; m < directions.size(); ++m) {
    std::vector<float> same(3 * count);
    for (int64_t i = 0; i < 3 * count; ++i) same[i] = directions[m][i % 3];
    const std::vector<float> seen =
        harmonics_seen(tape, Tensor::from(tape.device(), {count, 3}, std::span<const float>(same)), splats.rotations,
                       splats.harmonics);
    for (int64_t i = 0; i < count; ++i) {
      for (int64_t j = 0; j < coefficients; ++j) {
        for (int64_t c = 0; c < 3; ++c) {
          sums[(i * coefficients + j) * 3 + c] += fit(j, static_cast<Eigen::Index>(m)) * seen[3 * i + c];
        }
      }
    }
  }
  return {sums.begin(), sums.end()};
}

}  // namespace degas
