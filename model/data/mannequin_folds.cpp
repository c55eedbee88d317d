#include <cmath>
#include <numbers>

#include "model/data/mannequin_clothes.h"
#include "model/data/mannequin_parts.h"
#include "model/data/mannequin_texture.h"

namespace degas {
namespace {

using Eigen::Vector3d;

/// Ridges with sharp crests and wide troughs, mean about zero; `length` is the distance between crests.
double ridges(double travel, double length) {
  const double wave = std::cos(2 * std::numbers::pi * travel / length);
  return 0.5 * wave + 0.5 * std::exp(1.5 * (wave - 1)) - 0.2;
}

double sleeve_folds(const Vector3d& p, bool left, const MannequinPose& pose) {
  static const ArmFrame arm = mannequin_arm_frame();
  const double along = along_arm(p), from_elbow = along - arm.upper_length;
  const Vector3d mirrored(std::abs(p.x()), p.y(), p.z());
  const Vector3d axis_point =
      from_elbow < 0 ? Vector3d(arm.shoulder + along * arm.along) : Vector3d(arm.elbow() + from_elbow * arm.fore_along);
  const double front = (mirrored - axis_point).dot(arm.front) / 0.045, up = (mirrored - axis_point).dot(arm.up) / 0.045;
  const double elbow = pose.axis_angles[left ? 18 : 19].norm();
  const Vector3d& shoulder = pose.axis_angles[left ? 16 : 17];
  // Folds crowd in the crook of the elbow and shift along the sleeve as it bends.
  double height = 0.0064 * elbow * bell(from_elbow, 0.075) * (0.35 + 0.65 * smoothstep(-0.6, 0.8, front)) *
                  ridges(from_elbow + 0.010 * up + 0.006 * elbow, 0.036);
  const double raise = shoulder.norm();
  height += 0.0040 * raise * bell(along - 0.05, 0.075) * ridges(along + 0.022 * front + 0.03 * shoulder.z(), 0.045);
  height += 0.0024 * (0.4 + 0.8 * elbow) * smoothstep(0.30, 0.44, along) *
            ridges(along + 0.014 * std::sin(2.4 * front), 0.034);
  return height + 0.0016 * value_noise(Vector3d(along / 0.05, front * 0.9, up * 0.9));
}

double torso_folds(const Vector3d& p, const MannequinPose& pose) {
  const Vector3d spine = pose.axis_angles[3] + pose.axis_angles[6] + pose.axis_angles[9];
  const double x = p.x();
  double height = 0.0080 * spine.y() * bell(p.y() - 1.10, 0.14) * ridges(p.y() + (p.z() > 0 ? 0.55 : -0.55) * x, 0.070);
  height += 0.0080 * std::max(0.0, spine.x()) * bell(p.y() - 1.08, 0.10) * smoothstep(0.0, 0.07, p.z()) *
            ridges(p.y() + 0.06 * std::cos(9 * x), 0.052);
  height += 0.0080 * std::max(0.0, spine.z() * (x < 0 ? -1 : 1)) * bell(p.y() - 1.08, 0.10) *
            smoothstep(0.05, 0.13, std::abs(x)) * ridges(p.y(), 0.050);
  // A raised arm pulls the cloth: rays from the shoulder.
  const Vector3d& shoulder = pose.axis_angles[x > 0 ? 16 : 17];
  const double dx = std::abs(x) - 0.178, dy = p.y() - 1.405;
  const double distance = std::hypot(dx, dy), angle = std::atan2(dy, -dx);
  height += 0.0050 * shoulder.norm() * bell(distance - 0.11, 0.065) * ridges(angle + 0.4 * shoulder.z(), 0.75);
  const double loose = bell(p.y() - 1.02, 0.10);
  return height + 0.0030 * (0.5 + loose) * value_noise(Vector3d(x / 0.055, p.y() / 0.09, p.z() / 0.055));
}

double trouser_folds(MannequinChart chart, const Vector3d& p, const MannequinPose& pose) {
  const bool left = p.x() > 0;
  const Vector3d& hip = pose.axis_angles[left ? 1 : 2];
  const double flexion = std::max(0.0, -hip.x()), knee = pose.axis_angles[left ? 4 : 5].norm();
  const double x = std::abs(p.x());
  double height =
      0.0085 * flexion * bell(p.y() - 0.86, 0.08) * smoothstep(-0.02, 0.06, p.z()) * ridges(p.y() + 0.5 * x, 0.042);
  height += 0.0025 * bell(p.y() - 0.83, 0.06) * ridges(p.y() - 0.8 * x, 0.045);
  if (chart == MannequinChart::Torso) return height;
  const double back = smoothstep(0.03, -0.04, p.z());
  height += 0.0072 * knee * bell(p.y() - 0.487, 0.085) * (0.3 + 0.7 * back) * ridges(p.y() + 0.15 * (x - 0.107), 0.040);
  height += 0.0032 * (1 + 0.5 * knee) * bell(p.y() - 0.16, 0.075) *
            ridges(p.y() + 0.012 * std::sin(50 * x + 30 * p.z()), 0.036);
  return height + 0.0018 * value_noise(p / 0.06);
}

}  // namespace

double fold_height(MannequinChart chart, const Vector3d& rest, const MannequinPose& pose) {
  switch (mannequin_material(chart, rest)) {
    case MannequinMaterial::Trousers:
      return trouser_folds(chart, rest, pose);
    case MannequinMaterial::Shirt:
      return chart == MannequinChart::Torso ? torso_folds(rest, pose)
                                            : sleeve_folds(rest, chart == MannequinChart::LeftArm, pose);
    default:
      return 0;
  }
}

}  // namespace degas
