#include "model/data/mannequin_head_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "model/data/mannequin_parts.h"

namespace degas {
namespace {

using Eigen::Vector3d;

double sphere(const Vector3d& p, const Vector3d& center, double radius) {
  return (p - center).norm() - radius;
}

/// First-order distance to an ellipsoid: exact on the surface, a good step elsewhere.
double ellipsoid(const Vector3d& p, const Vector3d& center, const Vector3d& radii) {
  const Vector3d scaled = (p - center).cwiseQuotient(radii);
  const double level = scaled.norm(), slope = scaled.cwiseQuotient(radii).norm();
  return slope > 1e-12 ? level * (level - 1) / slope : -radii.minCoeff();
}

/// Capsule whose radius changes linearly from a to b.
double cone(const Vector3d& p, const Vector3d& a, const Vector3d& b, double radius_a, double radius_b) {
  const Vector3d axis = b - a;
  const double t = std::clamp((p - a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  return (p - a - t * axis).norm() - ((1 - t) * radius_a + t * radius_b);
}

/// Union with a fillet of size k.
double join(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k / 4;
}

double carve(double a, double b, double k) {
  return -join(-a, b, k);
}

double lip(const Vector3d& p, double height, double radius, double bow) {
  constexpr double half_width = 0.026;
  const double x = std::clamp(p.x(), -half_width, half_width), taper = 1 - 0.65 * x * x / (half_width * half_width);
  const Vector3d center(x, height - bow * std::exp(-x * x / (0.004 * 0.004)), 0.0885 - 12 * x * x);
  return (p - center).norm() - radius * taper;
}

}  // namespace

double head_distance(const Vector3d& position) {
  // The head is its own mirror image; lips and chin lie on the mirror plane.
  const Vector3d p(std::abs(position.x()), position.y(), position.z());
  double d = ellipsoid(p, {0, 1.668, -0.008}, {0.0755, 0.090, 0.099});
  d = join(d, ellipsoid(p, {0, 1.598, 0.022}, {0.0600, 0.064, 0.0710}), 0.030);
  d = join(d, cone(p, {0.056, 1.594, 0.002}, {0.018, 1.5450, 0.068}, 0.011, 0.013), 0.018);
  d = join(d, sphere(p, {0, 1.5450, 0.0765}, 0.0200), 0.020);
  d = join(d, cone(p, {0, 1.470, -0.026}, {0, 1.580, -0.018}, 0.0495, 0.0500), 0.018);
  d = join(d, sphere(p, {0.043, 1.608, 0.052}, 0.027), 0.020);
  d = join(d, ellipsoid(p, {0, 1.5780, 0.0640}, {0.030, 0.028, 0.0270}), 0.020);
  d = join(d, cone(p, {0.010, 1.6570, 0.0850}, {0.046, 1.6570, 0.0640}, 0.0110, 0.0090), 0.016);
  d = carve(d, ellipsoid(p, {0.0335, 1.6400, 0.1010}, {0.0200, 0.0130, 0.0170}), 0.014);
  d = join(d, cone(p, {0, 1.6480, 0.0900}, {0, 1.6080, 0.1115}, 0.0062, 0.0100), 0.014);
  d = join(d, sphere(p, {0.0120, 1.6025, 0.0985}, 0.0082), 0.008);
  d = join(d, lip(p, mouth_height + 0.0046, 0.0062, 0.0012), 0.012);
  d = join(d, lip(p, mouth_height - 0.0054, 0.0070, 0), 0.012);
  d = join(d, sphere(p, left_eye_center(), eye_radius + 0.0020), 0.004);
  d = join(d, ellipsoid(p, {0.0790, 1.630, -0.014}, {0.0120, 0.032, 0.019}), 0.008);
  return d;
}

Vector3d head_surface(double around, double from_below) {
  const Vector3d direction(std::sin(from_below) * std::sin(around), -std::cos(from_below),
                           std::sin(from_below) * std::cos(around));
  double reach = 0.22;
  for (int step = 0; step < 120; ++step) {
    const double distance = head_distance(head_center() + reach * direction);
    if (distance < 1e-6) break;
    reach -= 0.8 * distance;
  }
  return head_center() + reach * direction;
}

Vector3d head_center() {
  return {0, 1.632, 0.0};
}

}  // namespace degas
