#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/data/mannequin_parts.h"

namespace degas {
namespace {

using Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

/// Point of the superellipse with half axes 1: exponent 2 is the circle, larger ones are boxier.
Eigen::Vector2d superellipse(double angle, double exponent) {
  const double s = std::sin(angle), c = std::cos(angle), power = 2 / exponent;
  return {std::copysign(std::pow(std::abs(s), power), s), std::copysign(std::pow(std::abs(c), power), c)};
}

Vector3d side(const Vector3d& left_position, bool left) {
  return left ? left_position : Vector3d(-left_position.x(), left_position.y(), left_position.z());
}

/// A closed tube over a start loop; the ideal rings take over from the loop's own shape within `blend` rings.
std::vector<std::vector<int>> add_tube(MannequinBuilder& builder, const std::vector<int>& loop,
                                       const std::vector<std::vector<Vector3d>>& ideal,
                                       const std::vector<int>& ring_joints, int blend) {
  std::vector<std::vector<int>> rows{loop};
  Vector3d loop_center = Vector3d::Zero();
  for (const int v : loop) loop_center += builder.mesh.vertices[v] / static_cast<double>(loop.size());
  for (size_t r = 0; r < ideal.size(); ++r) {
    const double own = 1 - smoothstep(0, blend, static_cast<double>(r + 1));
    Vector3d center = Vector3d::Zero();
    for (const auto& p : ideal[r]) center += p / static_cast<double>(ideal[r].size());
    std::vector<int> row;
    for (size_t j = 0; j < loop.size(); ++j) {
      const Vector3d carried = builder.mesh.vertices[loop[j]] - loop_center + center;
      const double fairing = own > 0 ? 0.5 : 0;
      row.push_back(builder.add(own * carried + (1 - own) * ideal[r][j], ring_joints[r], fairing));
    }
    rows.push_back(row);
  }
  return rows;
}

void close_with_pole(MannequinBuilder& builder, std::vector<std::vector<int>>& rows, const Vector3d& tip, int joint) {
  rows.emplace_back(rows.back().size(), builder.add(tip, joint));
}

struct PalmRing {
  double at, half_thickness, half_width;
};

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
  for (const int v : loop) middle += side(builder.mesh.vertices[v], left) / 10.0;
  const auto angle_of = [&](int v) {
    const Vector3d d = side(builder.mesh.vertices[v], left) - middle;
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
      ring.push_back(side(frame.base + at * frame.along +
                              frame.radius * width[r] * (std::cos(angle) * across + 0.92 * std::sin(angle) * up),
                          left));
    }
    ideal.push_back(ring);
    joints.push_back(joint + (at > frame.joint_at[2] ? 2 : at > frame.joint_at[1] ? 1 : 0));
  }
  auto rows = add_tube(builder, loop, ideal, joints, 2);
  close_with_pole(builder, rows, side(frame.base + frame.length * frame.along, left), joint + 2);
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
    const Vector3d push = side(0.004 * mannequin_arm_frame().fore_along, left);
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

TorsoGrid add_torso(MannequinBuilder& builder) {
  // Height at front and back, half width, front z, back z, drop of the sides, superellipse exponent.
  static const std::vector<std::array<double, 7>> keys{
      {0.880, 0.172, 0.094, -0.110, -0.022, 2.20, 0}, {0.930, 0.174, 0.102, -0.122, -0.010, 2.25, 0},
      {0.980, 0.167, 0.106, -0.114, 0, 2.25, 0},      {1.030, 0.155, 0.104, -0.094, 0, 2.25, 0},
      {1.080, 0.146, 0.102, -0.082, 0, 2.25, 0},      {1.140, 0.146, 0.106, -0.082, 0, 2.30, 0},
      {1.200, 0.153, 0.114, -0.092, 0, 2.35, 0},      {1.260, 0.163, 0.123, -0.106, 0, 2.40, 0},
      {1.320, 0.171, 0.123, -0.117, 0, 2.40, 0},      {1.370, 0.175, 0.110, -0.122, 0.000, 2.35, 0},
      {1.415, 0.172, 0.090, -0.116, 0.000, 2.25, 0},  {1.445, 0.156, 0.073, -0.106, 0.002, 2.10, 0},
      {1.463, 0.130, 0.060, -0.098, 0.004, 2.00, 0},  {1.478, 0.096, 0.044, -0.089, 0.005, 2.00, 0},
      {1.491, 0.069, 0.034, -0.080, 0.004, 2.00, 0},  {1.503, 0.0565, 0.030, -0.076, 0.002, 2.00, 0}};
  const std::vector<double> heights{0.880, 0.905, 0.930, 0.955, 0.980, 1.005, 1.030, 1.055, 1.080, 1.105,
                                    1.130, 1.155, 1.180, 1.205, 1.230, 1.255, 1.280, 1.305, 1.330, 1.355,
                                    1.380, 1.405, 1.430, 1.449, 1.463, 1.475, 1.487, 1.503};
  TorsoGrid torso;
  torso.arm_row = 17;  // 1.305 .. 1.449
  for (const double height : heights) {
    const auto key = interpolate_keys(keys, height);
    std::vector<int> row;
    for (int c = 0; c < torso_columns; ++c) {
      const double angle = 2 * pi * c / torso_columns - pi, s = std::sin(angle);
      const Eigen::Vector2d e = superellipse(angle, key[5]);
      const double z = 0.5 * (key[2] + key[3]) + 0.5 * (key[2] - key[3]) * e.y();
      Vector3d p(key[1] * e.x(), height - key[4] * s * s, z);
      const int joint = p.y() < 1.005 ? 0 : p.y() < 1.115 ? 3 : p.y() < 1.22 ? 6 : p.y() < 1.49 ? 9 : 12;
      const bool collar = p.y() > 1.33 && std::abs(p.x()) > 0.075;
      row.push_back(builder.add(p, collar ? (p.x() > 0 ? 13 : 14) : joint, 0.02));
    }
    torso.rows.push_back(row);
  }
  // Fair the surroundings of the arm holes and of the crotch.
  for (size_t r = 0; r < torso.rows.size(); ++r) {
    for (int c = 0; c < torso_columns; ++c) {
      const int from_side = std::abs(std::abs(c - 32) - 16);
      const int row_distance =
          std::max({torso.arm_row - static_cast<int>(r), static_cast<int>(r) - torso.arm_row - 6, 0});
      const int outside = std::max(std::max(from_side - 4, 0), row_distance);
      if (outside <= 3) builder.smoothing[torso.rows[r][c]] = 0.5 * (1 - outside / 4.0);
      if (r < 3) builder.smoothing[torso.rows[r][c]] = 0.4 * (1 - static_cast<double>(r) / 3);
    }
  }
  MannequinGrid grid;
  grid.chart = MannequinChart::Torso;
  grid.rectangle = {0.006, 0.006, 0.494, 0.494};
  grid.rows = torso.rows;
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 8; ++c) {
      grid.holes.emplace_back(torso.arm_row + r, 44 + c);
      grid.holes.emplace_back(torso.arm_row + r, 12 + c);
    }
  }
  builder.mesh.add_grid(grid);
  return torso;
}

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
    for (auto& p : ring) p = side(p, left);
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

void add_legs(MannequinBuilder& builder, const TorsoGrid& torso) {
  const std::vector<int>& rim = torso.rows.front();
  constexpr int bridge_count = 7;
  std::vector<int> bridge;  // from back to front between the legs
  const Vector3d back = builder.mesh.vertices[rim[0]], front = builder.mesh.vertices[rim[32]];
  for (int k = 0; k < bridge_count; ++k) {
    const double t = (k + 1.0) / (bridge_count + 1);
    const double sag = 0.055 * std::pow(4 * t * (1 - t), 0.6);
    bridge.push_back(builder.add((1 - t) * back + t * front - Vector3d(0, sag, 0), 0, 0.4));
  }
  // Height, centre x, centre z, half width, half depth.
  static const std::vector<std::array<double, 5>> profile{
      {0.06, 0.118, -0.026, 0.034, 0.043}, {0.10, 0.118, -0.026, 0.033, 0.040}, {0.16, 0.116, -0.024, 0.038, 0.044},
      {0.24, 0.113, -0.024, 0.046, 0.053}, {0.34, 0.110, -0.018, 0.053, 0.060}, {0.42, 0.108, -0.008, 0.051, 0.056},
      {0.48, 0.107, 0.000, 0.053, 0.058},  {0.52, 0.106, 0.000, 0.056, 0.060},  {0.60, 0.102, -0.004, 0.066, 0.072},
      {0.70, 0.096, -0.008, 0.077, 0.085}, {0.78, 0.091, -0.010, 0.084, 0.094}, {0.86, 0.088, -0.010, 0.086, 0.100}};
  const std::vector<double> heights{0.830, 0.805, 0.780, 0.750, 0.720, 0.690, 0.660, 0.630, 0.600, 0.572,
                                    0.547, 0.524, 0.503, 0.483, 0.463, 0.440, 0.412, 0.384, 0.352, 0.320,
                                    0.288, 0.256, 0.224, 0.192, 0.162, 0.135, 0.112, 0.096};
  for (const bool left : {true, false}) {
    std::vector<int> loop{rim[32]};
    for (int c = 1; c < 32; ++c) loop.push_back(rim[left ? 32 + c : 32 - c]);
    loop.push_back(rim[0]);
    loop.insert(loop.end(), bridge.begin(), bridge.end());
    const int count = static_cast<int>(loop.size());  // 40: front, outside, back, inside
    std::vector<double> loop_angle;
    for (const int v : loop) {
      const Vector3d p = side(builder.mesh.vertices[v], left);
      double angle = std::atan2(p.x() - 0.088, p.z() + 0.010);
      if (!loop_angle.empty() && angle < loop_angle.back() - 0.2) angle += 2 * pi;
      loop_angle.push_back(angle);
    }
    std::vector<std::vector<Vector3d>> ideal;
    std::vector<int> joints;
    const int hip = left ? 1 : 2;
    for (const double height : heights) {
      const auto key = interpolate_keys(profile, height);
      const double even = smoothstep(0.84, 0.60, height);
      std::vector<Vector3d> ring;
      for (int j = 0; j < count; ++j) {
        const double angle = (1 - even) * loop_angle[j] + even * (2 * pi * j / count);
        ring.push_back(side({key[1] + key[3] * std::sin(angle), height, key[2] + key[4] * std::cos(angle)}, left));
      }
      ideal.push_back(ring);
      joints.push_back(height > 0.490 ? hip : height > 0.085 ? hip + 3 : hip + 6);
    }
    // The ankle's rings turn about the instep until they face forward: the heel is the outside of that turn.
    const Vector3d pivot(0.119, 0.098, 0.018);
    for (const double degrees : {16.0, 32.0, 48.0, 64.0, 78.0, 90.0}) {
      const double a = degrees * pi / 180, bulge = std::sin(2 * a);
      const double length = 0.088 + 0.004 * degrees / 90 + 0.036 * bulge;
      const Vector3d down(0, -std::sin(a), -std::cos(a));
      std::vector<Vector3d> ring;
      for (int j = 0; j < count; ++j) {
        const double angle = 2 * pi * j / count;
        const Vector3d p = pivot + (0.5 * length) * down - 0.5 * length * std::cos(angle) * down +
                           Vector3d(1, 0, 0) * (0.035 + 0.002 * degrees / 90) * std::sin(angle);
        ring.push_back(side({p.x(), std::max(p.y(), 0.004), p.z()}, left));
      }
      ideal.push_back(ring);
      joints.push_back(hip + 6);
    }
    // Forward distance, top height, half width, centre x.
    static const std::vector<std::array<double, 4>> foot{{0.018, 0.098, 0.037, 0.119}, {0.06, 0.076, 0.041, 0.123},
                                                         {0.10, 0.056, 0.046, 0.127},  {0.14, 0.042, 0.045, 0.128},
                                                         {0.175, 0.034, 0.036, 0.126}, {0.195, 0.024, 0.020, 0.124}};
    for (const double z : {0.040, 0.062, 0.084, 0.106, 0.128, 0.150, 0.168, 0.182, 0.191}) {
      const auto key = interpolate_keys(foot, z);
      std::vector<Vector3d> ring;
      for (int j = 0; j < count; ++j) {
        const Eigen::Vector2d e = superellipse(2 * pi * j / count, 2.6);
        ring.push_back(side({key[3] + key[2] * e.x(), 0.004 + (key[1] - 0.004) * (0.5 + 0.5 * e.y()), z}, left));
      }
      ideal.push_back(ring);
      joints.push_back(z > 0.10 ? hip + 9 : hip + 6);
    }
    auto rows = add_tube(builder, loop, ideal, joints, 5);
    close_with_pole(builder, rows, side({0.123, 0.013, 0.197}, left), hip + 9);
    MannequinGrid grid;
    grid.chart = left ? MannequinChart::LeftLeg : MannequinChart::RightLeg;
    const double u = left ? 0.506 : 0.756;
    grid.rectangle = {u, 0.626, u + 0.238, 0.006};
    grid.rows = rows;
    builder.mesh.add_grid(grid);
  }
}

}  // namespace degas
