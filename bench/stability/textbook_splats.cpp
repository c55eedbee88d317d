#include "bench/stability/textbook_splats.h"

#include <Eigen/Dense>
#include <algorithm>
#include <numeric>
#include <random>
#include <unsupported/Eigen/AutoDiff>

namespace degas::bench {
namespace {

template <typename Real>
using Number = Eigen::AutoDiffScalar<Eigen::Matrix<Real, numbers_of_scene, 1>>;

template <typename Real>
Number<Real> constant(double value) {
  return Number<Real>(static_cast<Real>(value), Eigen::Matrix<Real, numbers_of_scene, 1>::Zero());
}

/// keeps_gradient: the fault of passing the gradient on where the value is held.
template <typename Real>
Number<Real> clamped(const Number<Real>& value, double low, double high, bool keeps_gradient) {
  const auto held = std::clamp(value.value(), static_cast<Real>(low), static_cast<Real>(high));
  if (held == value.value()) return value;
  return keeps_gradient ? Number<Real>(held, value.derivatives()) : constant<Real>(held);
}

template <typename Real>
struct Ellipse {
  Number<Real> depth, u, v, a, b, c, opacity;  ///< a, b, c: of the inverse covariance [a b; b c]
  std::array<Number<Real>, 3> color;
};

/// False where the splat is behind the near plane.
template <typename Real>
bool project(const std::array<Number<Real>, numbers_of_scene>& numbers, int splat, const Camera& camera,
             const TextbookFaults& faults, Ellipse<Real>& ellipse) {
  using N = Number<Real>;
  using Matrix3 = Eigen::Matrix<N, 3, 3>;
  const N* n = &numbers[static_cast<size_t>(splat * numbers_of_splat)];
  Eigen::Matrix<N, 3, 1> p;
  Matrix3 view;
  for (int i = 0; i < 3; ++i) {
    N sum = constant<Real>(camera.translation[i]);
    for (int j = 0; j < 3; ++j) {
      view(i, j) = constant<Real>(camera.rotation(i, j));
      sum += view(i, j) * n[j];
    }
    p[i] = sum;
  }
  constexpr double near_plane = 0.05, blur = 0.3, beyond = 0.15;
  if (!(p[2].value() >= static_cast<Real>(near_plane))) return false;
  const N x = clamped<Real>(p[0] / p[2], (-beyond * camera.width - camera.cx) / camera.fx,
                            ((1 + beyond) * camera.width - camera.cx) / camera.fx, faults.ignores_frustum_clamp);
  const N y = clamped<Real>(p[1] / p[2], (-beyond * camera.height - camera.cy) / camera.fy,
                            ((1 + beyond) * camera.height - camera.cy) / camera.fy, faults.ignores_frustum_clamp);
  const N norm = sqrt(N(n[3] * n[3] + n[4] * n[4] + n[5] * n[5] + n[6] * n[6]));
  const N w = n[3] / norm, i = n[4] / norm, j = n[5] / norm, k = n[6] / norm;
  const N one = constant<Real>(1), two = constant<Real>(2), zero = constant<Real>(0);
  Matrix3 m;
  m << N(one - two * (j * j + k * k)), N(two * (i * j - w * k)), N(two * (i * k + w * j)),  //
      N(two * (i * j + w * k)), N(one - two * (i * i + k * k)), N(two * (j * k - w * i)),   //
      N(two * (i * k - w * j)), N(two * (j * k + w * i)), N(one - two * (i * i + j * j));
  for (int axis = 0; axis < 3; ++axis) {
    const N scale = exp(n[7 + axis]);
    for (int row = 0; row < 3; ++row) m(row, axis) = m(row, axis) * scale;
  }
  const N fx = constant<Real>(camera.fx) / p[2], fy = constant<Real>(camera.fy) / p[2];
  Eigen::Matrix<N, 2, 3> jacobian;
  jacobian << fx, zero, N(-fx * x), zero, fy, N(-fy * y);
  const Matrix3 world = m * m.transpose();
  const Eigen::Matrix<N, 2, 3> turned = jacobian * view;
  const Eigen::Matrix<N, 2, 2> covariance = turned * world * turned.transpose();
  const N xx = covariance(0, 0) + constant<Real>(blur), yy = covariance(1, 1) + constant<Real>(blur);
  const N determinant = xx * yy - covariance(0, 1) * covariance(0, 1);
  ellipse.a = yy / determinant;
  ellipse.b = -covariance(0, 1) / determinant;
  ellipse.c = xx / determinant;
  ellipse.depth = p[2];
  ellipse.u = constant<Real>(camera.fx) * p[0] / p[2] + constant<Real>(camera.cx);
  ellipse.v = constant<Real>(camera.fy) * p[1] / p[2] + constant<Real>(camera.cy);
  ellipse.opacity = n[10];
  for (int channel = 0; channel < 3; ++channel) ellipse.color[static_cast<size_t>(channel)] = n[11 + channel];
  return true;
}

}  // namespace

template <typename Real>
TextbookResult textbook_splats(const StressedScene& scene, const Camera& camera, const std::vector<double>& weights,
                               const TextbookFaults& faults) {
  using N = Number<Real>;
  std::array<N, numbers_of_scene> numbers;
  for (size_t i = 0; i < scene.size(); ++i) numbers[i] = N(static_cast<Real>(scene[i]), numbers_of_scene, int(i));
  std::vector<Ellipse<Real>> ellipses;
  for (int splat = 0; splat < splats_of_scene; ++splat) {
    Ellipse<Real> ellipse;
    if (project<Real>(numbers, splat, camera, faults, ellipse)) ellipses.push_back(ellipse);
  }
  std::stable_sort(ellipses.begin(), ellipses.end(),
                   [](const auto& a, const auto& b) { return a.depth.value() < b.depth.value(); });
  const int pixels = camera.width * camera.height;
  std::vector<int> order(static_cast<size_t>(pixels));
  std::iota(order.begin(), order.end(), 0);
  if (faults.sum_order > 0) std::shuffle(order.begin(), order.end(), std::mt19937(faults.sum_order));

  TextbookResult result;
  result.color.resize(static_cast<size_t>(3 * pixels));
  Eigen::Matrix<Real, numbers_of_scene, 1> gradient = Eigen::Matrix<Real, numbers_of_scene, 1>::Zero();
  constexpr Real alpha_min = Real(1.0 / 255), transmittance_min = Real(1e-4);
  for (const int pixel : order) {
    const N column = constant<Real>(pixel % camera.width + 0.5), row = constant<Real>(pixel / camera.width + 0.5);
    N transmittance = constant<Real>(1), loss = constant<Real>(0);
    for (const auto& ellipse : ellipses) {
      const N dx = column - ellipse.u, dy = row - ellipse.v;
      const N power = constant<Real>(-0.5) * (ellipse.a * dx * dx + ellipse.c * dy * dy) - ellipse.b * dx * dy;
      if (power.value() > 0) continue;  // where rounding has left no ellipse
      N alpha = ellipse.opacity * exp(power);
      if (!(alpha.value() >= alpha_min)) continue;
      alpha = clamped<Real>(alpha, 0, 0.99, faults.ignores_alpha_clamp);
      const N t = clamped<Real>(constant<Real>(255) * alpha - constant<Real>(1), 0, 1, false);
      alpha = alpha * t * t * (constant<Real>(3) - constant<Real>(2) * t);
      for (size_t channel = 0; channel < 3; ++channel) {
        const size_t at = 3 * static_cast<size_t>(pixel) + channel;
        const N shade = transmittance * alpha * ellipse.color[channel];
        result.color[at] += static_cast<double>(shade.value());
        loss += constant<Real>(weights[at]) * shade;
      }
      transmittance = transmittance * (constant<Real>(1) - alpha);
      if (transmittance.value() < transmittance_min) break;
    }
    gradient += loss.derivatives();
  }
  for (int i = 0; i < numbers_of_scene; ++i) result.gradient[static_cast<size_t>(i)] = gradient[i];
  return result;
}

template TextbookResult textbook_splats<float>(const StressedScene&, const Camera&, const std::vector<double>&,
                                               const TextbookFaults&);
template TextbookResult textbook_splats<double>(const StressedScene&, const Camera&, const std::vector<double>&,
                                                const TextbookFaults&);

}  // namespace degas::bench
