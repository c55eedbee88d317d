#pragma once

#include <cmath>

#include "model/data/mannequin_body.h"

/// What the mannequin's parts share while they are built; private to model/data/mannequin_*.cpp.
namespace degas {

/// The left arm's axes in the canonical pose. Right = mirror image in x.
struct ArmFrame {
  Eigen::Vector3d shoulder, along, fore_along, up, front;  // up = outer side of the arm, back of the hand
  double upper_length = 0, fore_length = 0;
  Eigen::Vector3d elbow() const { return shoulder + upper_length * along; }
  Eigen::Vector3d wrist() const { return elbow() + fore_length * fore_along; }
  /// From the little finger to the index, orthogonal to the forearm.
  Eigen::Vector3d hand_across() const { return (front - front.dot(fore_along) * fore_along).normalized(); }
  Eigen::Vector3d hand_up() const { return hand_across().cross(fore_along); }
};
ArmFrame mannequin_arm_frame();

/// A left finger: 0 index, 1 middle, 2 ring, 3 pinky, 4 thumb.
struct FingerFrame {
  Eigen::Vector3d base, along;
  double length = 0, radius = 0;
  std::array<double, 3> joint_at{};  // distance of the three joints from the base
};
Eigen::Vector3d finger_base(int finger);
FingerFrame finger_frame(int finger);

Eigen::Vector3d left_eye_center();
constexpr double eye_radius = 0.0128;
/// Centre of the closed lips' line.
constexpr double mouth_height = 1.5665;

/// State of the construction: the mesh and, per vertex, the joint it would follow rigidly.
struct MannequinBuilder {
  MannequinSkeleton skeleton = mannequin_skeleton();
  MannequinMesh mesh;
  std::vector<int> joint;         // per vertex
  std::vector<bool> below_mouth;  // per vertex
  std::vector<double> smoothing;  // per vertex: amount of fairing where parts meet
  /// A vertex of a bag (mouth cavity, lid rim) and the slit vertex whose expression it follows in part.
  struct Follower {
    int vertex, source;
    double factor;
  };
  std::vector<Follower> followers;
  /// Upper lid vertices close along this vector.
  std::vector<std::pair<int, Eigen::Vector3d>> lid_closing;

  int add(const Eigen::Vector3d& position, int follows_joint, double fairing = 0, bool lower = false);
};

constexpr int torso_columns = 64;
/// Torso: returns its rows; row 0 is the pelvis' lower rim, the last row the base of the neck. Column 32 is the
/// front, column 0 the back seam, columns above 32 lie on the left (+x).
struct TorsoGrid {
  std::vector<std::vector<int>> rows;
  int arm_row = 0;  // first row of the arm holes (6 faces high, columns 44..52 and mirrored)
};
TorsoGrid add_torso(MannequinBuilder& builder);
void add_arm(MannequinBuilder& builder, const TorsoGrid& torso, bool left);
/// Both legs share the bridge between them.
void add_legs(MannequinBuilder& builder, const TorsoGrid& torso);
void add_head(MannequinBuilder& builder, const std::vector<int>& neck_row);

/// Point of the superellipse with half axes 1 at an angle from +y towards +x: exponent 2 is the circle, larger ones
/// are boxier.
Eigen::Vector2d superellipse(double angle, double exponent);
/// The point itself on the left, its mirror image on the right.
Eigen::Vector3d mirrored_side(const Eigen::Vector3d& left_position, bool left);
/// A closed tube over a start loop; the ideal rings take over from the loop's own shape within `blend` rings. Returns
/// the loop and the rings.
std::vector<std::vector<int>> add_tube(MannequinBuilder& builder, const std::vector<int>& loop,
                                       const std::vector<std::vector<Eigen::Vector3d>>& ideal,
                                       const std::vector<int>& ring_joints, int blend);
void close_with_pole(MannequinBuilder& builder, std::vector<std::vector<int>>& rows, const Eigen::Vector3d& tip,
                     int joint);

/// Skinning weights by diffusion of the rigid assignment over the mesh.
Eigen::MatrixXf diffuse_weights(const MannequinBuilder& builder);
/// Non-negative where possible: the smallest combination of nearby vertices that gives the joint.
Eigen::MatrixXf joint_regressor(const MannequinBuilder& builder);
Eigen::MatrixXf expression_shapes(const MannequinBuilder& builder);
Eigen::MatrixXf body_shapes(const MannequinBuilder& builder);

/// Piecewise Catmull-Rom interpolation of keys (argument first), clamped at the ends.
template <size_t N>
std::array<double, N> interpolate_keys(const std::vector<std::array<double, N>>& keys, double t) {
  size_t i = 0;
  while (i + 2 < keys.size() && keys[i + 1][0] < t) ++i;
  const auto& a = keys[i > 0 ? i - 1 : 0];
  const auto& b = keys[i];
  const auto& c = keys[i + 1];
  const auto& d = keys[i + 2 < keys.size() ? i + 2 : i + 1];
  const double x = std::min(1.0, std::max(0.0, (t - b[0]) / (c[0] - b[0]))), span = c[0] - b[0];
  std::array<double, N> result{};
  result[0] = t;
  for (size_t k = 1; k < N; ++k) {
    const double slope_b = (c[k] - a[k]) / (c[0] - a[0]) * span, slope_c = (d[k] - b[k]) / (d[0] - b[0]) * span;
    result[k] = b[k] * (1 + x * x * (2 * x - 3)) + c[k] * x * x * (3 - 2 * x) + slope_b * x * (1 - x) * (1 - x) -
                slope_c * x * x * (1 - x);
  }
  return result;
}

/// 1 at 0, falling to both sides as a Gaussian does.
inline double bell(double x, double width) {
  return std::exp(-x * x / (width * width));
}

inline double smoothstep(double low, double high, double x) {
  const double t = std::min(1.0, std::max(0.0, (x - low) / (high - low)));
  return t * t * (3 - 2 * t);
}

}  // namespace degas
