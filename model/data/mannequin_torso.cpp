#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/data/mannequin_parts.h"

namespace degas {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

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

}  // namespace degas
