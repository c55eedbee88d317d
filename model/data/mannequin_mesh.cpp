#include "model/data/mannequin_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <set>

namespace degas {

int MannequinMesh::add_vertex(const Eigen::Vector3d& position) {
  vertices.push_back(position);
  return static_cast<int>(vertices.size()) - 1;
}

void MannequinMesh::add_grid(const MannequinGrid& grid) {
  const int row_count = grid.row_count(), columns = grid.column_count();
  const int faces = grid.closed ? columns : columns - 1;
  const int first_texture = static_cast<int>(texture_vertices.size());
  const auto& rect = grid.rectangle;
  for (int r = 0; r < row_count; ++r) {
    for (int c = 0; c <= faces; ++c) {
      texture_vertices.emplace_back(rect.u0 + (rect.u1 - rect.u0) * c / faces,
                                    rect.v0 + (rect.v1 - rect.v0) * r / (row_count - 1));
    }
  }
  const auto texture = [&](int r, int c) { return first_texture + r * (faces + 1) + c; };
  const size_t first_triangle = triangles.size();
  double outwardness = 0;
  for (int r = 0; r + 1 < row_count; ++r) {
    const bool slit = !grid.rows_above.empty() && !grid.rows_above[r].empty();
    const std::vector<int>& low = slit ? grid.rows_above[r] : grid.rows[r];
    const std::vector<int>& high = grid.rows[r + 1];
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (int c = 0; c < columns; ++c) center += (vertices[low[c]] + vertices[high[c]]) / (2.0 * columns);
    for (int c = 0; c < faces; ++c) {
      if (std::find(grid.holes.begin(), grid.holes.end(), std::pair(r, c)) != grid.holes.end()) continue;
      const int d = (c + 1) % columns;
      const std::array<Eigen::Vector3i, 2> corners{Eigen::Vector3i(low[c], low[d], high[d]),
                                                   Eigen::Vector3i(low[c], high[d], high[c])};
      const std::array<Eigen::Vector3i, 2> texels{
          Eigen::Vector3i(texture(r, c), texture(r, c + 1), texture(r + 1, c + 1)),
          Eigen::Vector3i(texture(r, c), texture(r + 1, c + 1), texture(r + 1, c))};
      for (int half = 0; half < 2; ++half) {
        const Eigen::Vector3i& t = corners[half];
        if (t[0] == t[1] || t[1] == t[2] || t[0] == t[2]) continue;
        const Eigen::Vector3d a = vertices[t[0]], normal = (vertices[t[1]] - a).cross(vertices[t[2]] - a);
        outwardness += normal.dot((a + vertices[t[1]] + vertices[t[2]]) / 3 - center);
        triangles.push_back(t);
        texture_triangles.push_back(texels[half]);
        triangle_charts.push_back(grid.chart);
      }
    }
  }
  if ((outwardness < 0) == grid.inward) return;
  for (size_t i = first_triangle; i < triangles.size(); ++i) {
    std::swap(triangles[i][1], triangles[i][2]);
    std::swap(texture_triangles[i][1], texture_triangles[i][2]);
  }
}

std::vector<std::vector<int>> MannequinMesh::neighbors() const {
  std::vector<std::vector<int>> result(vertices.size());
  for (const auto& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      result[t[k]].push_back(t[(k + 1) % 3]);
      result[t[k]].push_back(t[(k + 2) % 3]);
    }
  }
  for (auto& list : result) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return result;
}

void MannequinMesh::smooth(const std::vector<double>& amount, int iterations) {
  const auto around = neighbors();
  for (int iteration = 0; iteration < iterations; ++iteration) {
    std::vector<Eigen::Vector3d> moved = vertices;
    for (size_t v = 0; v < vertices.size(); ++v) {
      if (amount[v] <= 0 || around[v].empty()) continue;
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const int n : around[v]) mean += vertices[n];
      moved[v] += amount[v] * (mean / static_cast<double>(around[v].size()) - vertices[v]);
    }
    vertices.swap(moved);
  }
}

std::vector<Eigen::Vector3d> vertex_normals(const std::vector<Eigen::Vector3d>& vertices,
                                            const std::vector<Eigen::Vector3i>& triangles) {
  std::vector<Eigen::Vector3d> normals(vertices.size(), Eigen::Vector3d::Zero());
  for (const auto& t : triangles) {
    const Eigen::Vector3d normal = (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]);
    for (int k = 0; k < 3; ++k) normals[t[k]] += normal;
  }
  for (auto& normal : normals) normal = normal.norm() > 1e-18 ? normal.normalized() : Eigen::Vector3d::UnitY();
  return normals;
}

}  // namespace degas
