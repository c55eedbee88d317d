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
      const Vector3d p = mirrored_side(builder.mesh.vertices[v], left);
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
        ring.push_back(
            mirrored_side({key[1] + key[3] * std::sin(angle), height, key[2] + key[4] * std::cos(angle)}, left));
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
        ring.push_back(mirrored_side({p.x(), std::max(p.y(), 0.004), p.z()}, left));
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
        ring.push_back(
            mirrored_side({key[3] + key[2] * e.x(), 0.004 + (key[1] - 0.004) * (0.5 + 0.5 * e.y()), z}, left));
      }
      ideal.push_back(ring);
      joints.push_back(z > 0.10 ? hip + 9 : hip + 6);
    }
    auto rows = add_tube(builder, loop, ideal, joints, 5);
    close_with_pole(builder, rows, mirrored_side({0.123, 0.013, 0.197}, left), hip + 9);
    MannequinGrid grid;
    grid.chart = left ? MannequinChart::LeftLeg : MannequinChart::RightLeg;
    const double u = left ? 0.506 : 0.756;
    grid.rectangle = {u, 0.626, u + 0.238, 0.006};
    grid.rows = rows;
    builder.mesh.add_grid(grid);
  }
}

}  // namespace degas
