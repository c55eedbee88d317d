#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "model/data/mannequin_head_surface.h"
#include "model/data/mannequin_parts.h"

namespace degas {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;
constexpr int columns = torso_columns, front = columns / 2;
constexpr int mouth_half = 6, eye_inner = 4, eye_outer = 10;  // slit ends in columns from the front
constexpr int joint_head = 15, joint_jaw = 22;

/// Angle of a column about the vertical: columns are 2.6 degrees apart in the face, 11 at the back.
double column_angle(int column) {
  const double t = static_cast<double>(column - front) / front;
  return pi * (0.46 * t + 0.54 * t * t * t);
}

/// Angles from straight down, degrees; finely spaced at lips and lids.
const std::vector<double>& row_angles() {
  static const std::vector<double> angles{38,   42,    45.5,  48.5, 51,   53,   54.7,  56.2, 57.7, 59.4,  61.4,
                                          63.8, 66.4,  69.2,  72,   74.8, 77.6, 80.4,  83,   85.4, 87.6,  89.4,
                                          91,   92.6,  94.2,  95.8, 97.4, 99.2, 101.4, 104,  107,  110.5, 114,
                                          118,  122.5, 127.5, 133,  139,  145,  151,   157,  163,  169,   175};
  return angles;
}
constexpr int mouth_row = 7, eye_row = 24;

/// How far the lids stand open at a column, 0 at the slit's ends, 1 in the middle.
double lid_profile(int column) {
  const double x = (std::abs(column - front) - 0.5 * (eye_inner + eye_outer)) / (0.5 * (eye_outer - eye_inner));
  return std::abs(x) >= 1 ? 0 : std::pow(1 - x * x, 0.7);
}

Vector3d head_point(int row, int column, bool upper_lid) {
  constexpr double upper_opening = 3.1, lower_opening = 2.0;  // degrees
  const double opening = upper_lid ? upper_opening : -lower_opening;
  const double angle = row_angles()[row] + opening * lid_profile(column) * std::exp(-std::abs(row - eye_row) / 3.0);
  return head_surface(column_angle(column), angle * pi / 180);
}

bool inside_slit(int column, int first, int last) {
  return column > first && column < last;
}

struct HeadRows {
  std::vector<std::vector<int>> rows, rows_above;
  int first_ray_row = 0;
};

/// Loop around a slit: one corner, the lower edge, the other corner, the upper edge back.
std::vector<int> slit_loop(const std::vector<int>& lower, const std::vector<int>& upper, int first, int last) {
  std::vector<int> loop;
  for (int c = first; c <= last; ++c) loop.push_back(lower[c]);
  for (int c = last - 1; c > first; --c) loop.push_back(upper[c]);
  return loop;
}

HeadRows add_head_rows(MannequinBuilder& builder, const std::vector<int>& neck_row) {
  HeadRows head;
  head.rows.push_back(neck_row);
  constexpr int neck_rows = 4;
  for (int r = 1; r <= neck_rows; ++r) {
    const double t = static_cast<double>(r) / (neck_rows + 1);
    std::vector<int> row;
    for (int c = 0; c < columns; ++c) {
      const Vector3d low = builder.mesh.vertices[neck_row[c]], high = head_point(0, c, false);
      // Straight up first, outwards towards the jaw last.
      const double outward = t * t, rise = 1 - (1 - t) * (1 - t) * (0.3 * t + 1);
      const Vector3d p((1 - outward) * low.x() + outward * high.x(), (1 - rise) * low.y() + rise * high.y(),
                       (1 - outward) * low.z() + outward * high.z());
      row.push_back(builder.add(p, 12, 0.45));
    }
    head.rows.push_back(row);
  }
  head.first_ray_row = static_cast<int>(head.rows.size());
  head.rows_above.resize(head.rows.size());
  for (int r = 0; r < static_cast<int>(row_angles().size()); ++r) {
    std::vector<int> row, above;
    for (int c = 0; c < columns; ++c) {
      const double around = std::abs(column_angle(c));
      const Vector3d p = head_point(r, c, r > eye_row);
      const bool neck = row_angles()[r] < 42 && around > 0.9;
      const bool lower_jaw = r <= mouth_row && r >= 1 && around < 1.15;
      row.push_back(builder.add(p,
                                lower_jaw ? joint_jaw
                                : neck    ? 12
                                          : joint_head,
                                r == 0  ? 0.4
                                : r < 3 ? 0.2
                                        : 0.05,
                                r <= mouth_row && around < 1.6));
    }
    if (r == mouth_row) {
      above = row;
      for (int c = 0; c < columns; ++c) {
        if (!inside_slit(c, front - mouth_half, front + mouth_half)) continue;
        const Vector3d p = builder.mesh.vertices[row[c]];
        above[c] = builder.add(p + Vector3d(0, 0.0004, 0), joint_head);
        builder.smoothing[row[c]] = 0;
      }
      builder.smoothing[row[front - mouth_half]] = builder.smoothing[row[front + mouth_half]] = 0;
    }
    if (r == eye_row) {
      above = row;
      for (int c = 0; c < columns; ++c) {
        const int offset = std::abs(c - front);
        if (offset == eye_inner || offset == eye_outer) builder.smoothing[row[c]] = 0;
        if (!inside_slit(offset, eye_inner, eye_outer)) continue;
        above[c] = builder.add(head_point(r, c, true), joint_head);
        builder.smoothing[row[c]] = 0;
      }
    }
    head.rows.push_back(row);
    head.rows_above.push_back(above);
  }
  const Vector3d crown = head_surface(0, pi);
  head.rows.emplace_back(columns, builder.add(crown, joint_head));
  head.rows_above.emplace_back();
  // The upper lids close onto the lower ones; the skin above follows less and less.
  const int lids = head.first_ray_row + eye_row;
  for (int k = 0; k <= 8; ++k) {
    for (int c = 0; c < columns; ++c) {
      if (lid_profile(c) <= 0) continue;
      const Vector3d closing =
          builder.mesh.vertices[head.rows[lids][c]] - builder.mesh.vertices[head.rows_above[lids][c]];
      const int vertex = k == 0 ? head.rows_above[lids][c] : head.rows[lids + k][c];
      builder.lid_closing.emplace_back(vertex, closing * std::exp(-k / 2.5));
    }
  }
  return head;
}

void add_mouth_bag(MannequinBuilder& builder, const std::vector<int>& loop) {
  // Depth behind the lips, half height of the cavity, width, share of the lips' motion.
  constexpr std::array<std::array<double, 4>, 4> rings{
      {{0.005, 0.0005, 1.0, 1.0}, {0.013, 0.0095, 1.0, 0.7}, {0.028, 0.0130, 0.95, 0.3}, {0.043, 0.0090, 0.6, 0}}};
  const int count = static_cast<int>(loop.size()), corner = count / 2;
  MannequinGrid grid;
  grid.chart = MannequinChart::MouthBag;
  grid.rectangle = {0.006, 0.508, 0.200, 0.590};
  grid.inward = true;
  grid.rows.push_back(loop);
  for (const auto& ring : rings) {
    std::vector<int> row;
    for (int j = 0; j < count; ++j) {
      const bool lower = j < corner, end = j == 0 || j == corner;
      const double across = (j <= corner ? j : count - j) / static_cast<double>(corner) * 2 - 1;
      const double height = end ? 0 : ring[1] * std::sqrt(1 - across * across) * (lower ? -1 : 1);
      const Vector3d p = builder.mesh.vertices[loop[j]];
      row.push_back(builder.add({p.x() * ring[2], p.y() + height, p.z() - ring[0]},
                                lower && !end ? joint_jaw : joint_head, 0, lower));
      if (ring[3] > 0) builder.followers.push_back({row.back(), loop[j], ring[3]});
    }
    grid.rows.push_back(row);
  }
  const int throat = builder.add({0, mouth_height, 0.030}, joint_head);
  grid.rows.emplace_back(count, throat);
  builder.mesh.add_grid(grid);
}

void add_teeth(MannequinBuilder& builder, bool upper) {
  MannequinGrid grid;
  grid.chart = upper ? MannequinChart::UpperTeeth : MannequinChart::LowerTeeth;
  grid.rectangle = {0.21, upper ? 0.552 : 0.508, 0.300, upper ? 0.590 : 0.546};
  grid.closed = false;
  const double low = mouth_height + (upper ? -0.0032 : -0.0100), high = mouth_height + (upper ? 0.0085 : -0.0028);
  for (int r = 0; r < 3; ++r) {
    std::vector<int> row;
    for (int c = 0; c <= 12; ++c) {
      const double x = 0.0225 * (c / 6.0 - 1), z = (upper ? 0.0795 : 0.0780) - 22 * x * x;
      const double y = low + (high - low) * r / 2;
      row.push_back(builder.add({x, y, z}, upper ? joint_head : joint_jaw, 0, !upper));
    }
    grid.rows.push_back(row);
  }
  // A strip has no inside: the row's centre lies behind the arch, so that outward faces the lips.
  builder.mesh.add_grid(grid);
}

void add_eye(MannequinBuilder& builder, const std::vector<int>& loop, bool left) {
  Vector3d center = left_eye_center();
  if (!left) center.x() = -center.x();
  MannequinGrid rim;
  rim.chart = left ? MannequinChart::LeftEyeRim : MannequinChart::RightEyeRim;
  const double u = left ? 0.31 : 0.405;
  rim.rectangle = {u, 0.575, u + 0.085, 0.590};
  rim.inward = true;
  rim.rows.push_back(loop);
  std::vector<int> inner;
  for (const int v : loop) {
    const Vector3d out = (builder.mesh.vertices[v] - center).normalized();
    inner.push_back(builder.add(center + (eye_radius - 0.0012) * out, joint_head));
    builder.followers.push_back({inner.back(), v, 1.0});
  }
  rim.rows.push_back(inner);
  builder.mesh.add_grid(rim);

  MannequinGrid ball;
  ball.chart = left ? MannequinChart::LeftEye : MannequinChart::RightEye;
  ball.rectangle = {u, 0.568, u + 0.085, 0.508};
  const int joint = left ? 23 : 24;
  constexpr int segments = 16;
  ball.rows.emplace_back(segments, builder.add(center + Vector3d(0, 0, eye_radius), joint));
  for (const double degrees : {13.0, 26.0, 40.0, 56.0, 76.0, 100.0, 125.0}) {
    std::vector<int> row;
    for (int j = 0; j < segments; ++j) {
      const double a = degrees * pi / 180, around = 2 * pi * j / segments;
      const Vector3d out(std::sin(a) * std::sin(around), std::sin(a) * std::cos(around), std::cos(a));
      row.push_back(builder.add(center + eye_radius * out, joint));
    }
    ball.rows.push_back(row);
  }
  const size_t first = builder.mesh.triangles.size();
  builder.mesh.add_grid(ball);
  // The rows' centres lie inside the sphere only for its back half; orient by the eye's centre instead.
  const auto& t = builder.mesh.triangles[first];
  const auto& v = builder.mesh.vertices;
  const Vector3d normal = (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]);
  if (normal.dot(v[t[0]] - center) > 0) return;
  for (size_t i = first; i < builder.mesh.triangles.size(); ++i) {
    std::swap(builder.mesh.triangles[i][1], builder.mesh.triangles[i][2]);
    std::swap(builder.mesh.texture_triangles[i][1], builder.mesh.texture_triangles[i][2]);
  }
}

}  // namespace

void add_head(MannequinBuilder& builder, const std::vector<int>& neck_row) {
  const HeadRows head = add_head_rows(builder, neck_row);
  MannequinGrid grid;
  grid.chart = MannequinChart::Head;
  grid.rectangle = {0.006, 0.600, 0.494, 0.994};
  grid.rows = head.rows;
  grid.rows_above = head.rows_above;
  builder.mesh.add_grid(grid);
  const auto& lips = head.rows[head.first_ray_row + mouth_row];
  const auto& lips_above = head.rows_above[head.first_ray_row + mouth_row];
  add_mouth_bag(builder, slit_loop(lips, lips_above, front - mouth_half, front + mouth_half));
  add_teeth(builder, true);
  add_teeth(builder, false);
  const auto& lids = head.rows[head.first_ray_row + eye_row];
  const auto& lids_above = head.rows_above[head.first_ray_row + eye_row];
  add_eye(builder, slit_loop(lids, lids_above, front + eye_inner, front + eye_outer), true);
  add_eye(builder, slit_loop(lids, lids_above, front - eye_outer, front - eye_inner), false);
}

}  // namespace degas
