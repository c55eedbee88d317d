#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/data/mannequin_parts.h"

namespace degas {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

/// Ring of the arm or hand. Index 0 is the thumb's side, 7 the back of the hand, 14 the little finger's side.
/// box = 1 gives the hand's order: 12 edges over the back, 12 over the palm, 2 on each side.
std::vector<Vector3d> arm_ring(const Vector3d& center, const Vector3d& across, const Vector3d& up, double width,
                               double thickness, double box) {
  std::vector<Vector3d> ring;
  for (int j = 0; j < 28; ++j) {
    const double angle = 2 * pi * j / 28;
    const Vector3d round = std::cos(angle) * width * across + std::sin(angle) * thickness * up;
    // The box: indices 1..13 run over the back from thumb to little finger, 15..27 return over the palm.
    const bool back = j >= 1 && j <= 13, palm = j >= 15;
    const double travel = back ? (j - 1) / 12.0 : palm ? (27 - j) / 12.0 : j == 0 ? -0.06 : 1.06;
    const double x = 1 - 2 * travel, height = std::sqrt(std::max(0.0, 1 - 0.55 * x * x)) * (back ? 1 : palm ? -1 : 0);
    const Vector3d flat = x * 0.94 * width * across + height * thickness * up;
    ring.push_back(center + (1 - box) * round + box * flat);
  }
  return ring;
}

/// A finger over a loop of ten vertices whose first is dorsal.
void add_finger(MannequinBuilder& builder, const std::vector<int>& loop, int finger, bool left) {
  const FingerFrame frame = finger_frame(finger);
  const ArmFrame arm = mannequin_arm_frame();
  const Vector3d across = (arm.hand_across() - arm.hand_across().dot(frame.along) * frame.along).normalized();
  const Vector3d up = across.cross(frame.along);
  constexpr std::array<int, 5> first_joint{25, 28, 34, 31, 37};
  const int joint = first_joint[finger] + (left ? 0 : 15);
  // The loop starts somewhere on the ring; the ideal rings start at the same angle.
  Vector3d middle = Vector3d::Zero();
  for (const int v : loop) middle += mirrored_side(builder.mesh.vertices[v], left) / 10.0;
  const auto angle_of = [&](int v) {
    const Vector3d d = mirrored_side(builder.mesh.vertices[v], left) - middle;
    return std::atan2(d.dot(up), d.dot(across));
  };
  const double first = angle_of(loop[0]);
  double turn = angle_of(loop[2]) - first;
  turn -= 2 * pi * std::round(turn / (2 * pi));
  const double step = std::copysign(2 * pi / 10, turn);
  constexpr std::array<double, 8> stations{0.10, 0.24, 0.38, 0.50, 0.64, 0.76, 0.88, 0.965};
  constexpr std::array<double, 8> width{1.06, 1.0, 0.97, 1.0, 0.90, 0.90, 0.82, 0.58};
  std::vector<std::vector<Vector3d>> ideal;
  std::vector<int> joints;
  for (int r = 0; r < 8; ++r) {
    const double at = stations[r] * frame.length;
    std::vector<Vector3d> ring;
    for (int j = 0; j < 10; ++j) {
      const double angle = first + j * step;
      ring.push_back(
          mirrored_side(frame.base + at * frame.along +
                            frame.radius * width[r] * (std::cos(angle) * across + 0.92 * std::sin(angle) * up),
                        left));
    }
    ideal.push_back(ring);
    joints.push_back(joint + (at > frame.joint_at[2] ? 2 : at > frame.joint_at[1] ? 1 : 0));
  }
  auto rows = add_tube(builder, loop, ideal, joints, 2);
  close_with_pole(builder, rows, mirrored_side(frame.base + frame.length * frame.along, left), joint + 2);
  MannequinGrid grid;
  grid.chart = left ? MannequinChart::LeftFingers : MannequinChart::RightFingers;
  const double u = 0.829 + 0.034 * finger, v = left ? 0.820 : 0.640;
  grid.rectangle = {u, v, u + 0.027, v + 0.170};
  grid.rows = rows;
  builder.mesh.add_grid(grid);
}

void add_hand(MannequinBuilder& builder, std::vector<std::vector<int>>& rows, int thumb_row, bool left) {
  const int hand = left ? 20 : 21;
  const std::vector<int>& end = rows.back();
  std::array<int, 3> web{};
  for (int g = 0; g < 3; ++g) {
    const auto& v = builder.mesh.vertices;
    const Vector3d push = mirrored_side(0.004 * mannequin_arm_frame().fore_along, left);
    web[g] = builder.add(0.5 * (v[end[4 + 3 * g]] + v[end[24 - 3 * g]]) - push, hand);
  }
  add_finger(builder, {end[1], end[2], end[3], end[4], web[0], end[24], end[25], end[26], end[27], end[0]}, 0, left);
  add_finger(builder, {end[4], end[5], end[6], end[7], web[1], end[21], end[22], end[23], end[24], web[0]}, 1, left);
  add_finger(builder, {end[7], end[8], end[9], end[10], web[2], end[18], end[19], end[20], end[21], web[1]}, 2, left);
  add_finger(builder, {end[10], end[11], end[12], end[13], end[14], end[15], end[16], end[17], end[18], web[2]}, 3,
             left);
  const auto at = [&](int row, int j) { return rows[thumb_row + row][(j + 28) % 28]; };
  add_finger(builder,
             {at(0, 1), at(1, 1), at(2, 1), at(3, 1), at(3, 0), at(3, -1), at(2, -1), at(1, -1), at(0, -1), at(0, 0)},
             4, left);
}

}  // namespace

void add_arm(MannequinBuilder& builder, const TorsoGrid& torso, bool left) {
  const auto hole = [&](int row, int column) {
    const int c = 44 + column;
    return torso.rows[torso.arm_row + row][left ? c : torso_columns - c];
  };
  std::vector<int> loop;
  for (int r = 3; r < 6; ++r) loop.push_back(hole(r, 0));
  for (int c = 0; c < 8; ++c) loop.push_back(hole(6, c));
  for (int r = 6; r > 0; --r) loop.push_back(hole(r, 8));
  for (int c = 8; c > 0; --c) loop.push_back(hole(0, c));
  for (int r = 0; r < 3; ++r) loop.push_back(hole(r, 0));
  // Distance along the arm from the shoulder; half width (front-back), half thickness (up-down).
  static const std::vector<std::array<double, 3>> profile{
      {0.00, 0.058, 0.056},  {0.05, 0.057, 0.055},   {0.10, 0.050, 0.050},  {0.16, 0.046, 0.047},
      {0.22, 0.041, 0.042},  {0.275, 0.039, 0.039},  {0.33, 0.042, 0.040},  {0.39, 0.038, 0.036},
      {0.46, 0.031, 0.028},  {0.53, 0.030, 0.022},   {0.55, 0.033, 0.0200}, {0.575, 0.040, 0.0185},
      {0.60, 0.043, 0.0165}, {0.622, 0.0425, 0.0130}};
  const std::vector<double> stations{0.030, 0.050, 0.070, 0.090, 0.110, 0.130, 0.150, 0.172, 0.194, 0.216, 0.236,
                                     0.252, 0.266, 0.280, 0.294, 0.310, 0.330, 0.352, 0.376, 0.400, 0.424, 0.448,
                                     0.472, 0.496, 0.516, 0.532, 0.548, 0.563, 0.578, 0.593, 0.606, 0.619};
  constexpr int thumb_row = 27;  // in rows, which begin with the loop: stations 0.548 .. 0.593
  const ArmFrame arm = mannequin_arm_frame();
  std::vector<std::vector<Vector3d>> ideal;
  std::vector<int> joints;
  for (const double at : stations) {
    const auto key = interpolate_keys(profile, at);
    const double bend = smoothstep(arm.upper_length - 0.03, arm.upper_length + 0.03, at);
    const Vector3d center =
        at < arm.upper_length ? arm.shoulder + at * arm.along : arm.elbow() + (at - arm.upper_length) * arm.fore_along;
    const Vector3d across = ((1 - bend) * arm.front + bend * arm.hand_across()).normalized();
    const Vector3d up = ((1 - bend) * arm.up + bend * arm.hand_up()).normalized();
    auto ring = arm_ring(center, across, up, key[1], key[2], smoothstep(0.52, 0.57, at));
    for (auto& p : ring) p = mirrored_side(p, left);
    ideal.push_back(ring);
    joints.push_back((at < 0.018 ? 13 : at < arm.upper_length ? 16 : at < 0.530 ? 18 : 20) + (left ? 0 : 1));
  }
  auto rows = add_tube(builder, loop, ideal, joints, 6);
  MannequinGrid grid;
  grid.chart = left ? MannequinChart::LeftArm : MannequinChart::RightArm;
  const double u = left ? 0.506 : 0.666;
  grid.rectangle = {u, 0.994, u + 0.150, 0.640};
  grid.rows = rows;
  for (int r = 0; r < 3; ++r) {
    grid.holes.emplace_back(thumb_row + r, 27);
    grid.holes.emplace_back(thumb_row + r, 0);
  }
  builder.mesh.add_grid(grid);
  add_hand(builder, rows, thumb_row, left);
}

}  // namespace degas
