#pragma once

#include <Eigen/Core>
#include <vector>

namespace degas {

/// One rectangle of the mannequin's UV atlas. The head's charts (Head .. RightEyeRim) fill the top-left quarter.
enum class MannequinChart : int {
  Head,
  MouthBag,
  UpperTeeth,
  LowerTeeth,
  LeftEye,
  RightEye,
  LeftEyeRim,
  RightEyeRim,
  Torso,
  LeftArm,
  RightArm,
  LeftLeg,
  RightLeg,
  LeftFingers,  // five rectangles: index, middle, ring, pinky, thumb
  RightFingers
};

/// A rectangle of the atlas; v0 > v1 turns the rows upside down.
struct UvRectangle {
  double u0 = 0, v0 = 0, u1 = 1, v1 = 1;
};

/// A grid of vertices that covers a tube (closed) or a strip: row by row, rows[r][c] is a vertex index.
struct MannequinGrid {
  MannequinChart chart = MannequinChart::Torso;
  UvRectangle rectangle;
  std::vector<std::vector<int>> rows;
  /// Where a row is a slit (lids, lips), the faces above it use these vertices instead; empty = no slit in the row.
  std::vector<std::vector<int>> rows_above;
  std::vector<std::pair<int, int>> holes;  // faces (row, column) left out
  bool closed = true;                      // the last column continues with the first
  bool inward = false;                     // normals point to the rows' centres (mouth cavity)

  int row_count() const { return static_cast<int>(rows.size()); }
  int column_count() const { return static_cast<int>(rows.front().size()); }
};

/// Triangle mesh with separate texture vertices, built of grids that share boundary vertices.
struct MannequinMesh {
  std::vector<Eigen::Vector3d> vertices;           // metres
  std::vector<Eigen::Vector2d> texture_vertices;   // u right, v up, in 0..1
  std::vector<Eigen::Vector3i> triangles;          // counter-clockwise seen from outside
  std::vector<Eigen::Vector3i> texture_triangles;  // the same corners in texture_vertices
  std::vector<MannequinChart> triangle_charts;     // per triangle

  int add_vertex(const Eigen::Vector3d& position);
  /// Emits the grid's triangles (two per face, none where a pole collapses an edge), oriented outward.
  void add_grid(const MannequinGrid& grid);
  /// Edge neighbours of every vertex, ascending.
  std::vector<std::vector<int>> neighbors() const;
  /// Umbrella smoothing: `amount` (0..1) per vertex is the step towards the mean of its neighbours.
  void smooth(const std::vector<double>& amount, int iterations);
};

/// Area-weighted unit vertex normals of a posed copy of a mesh.
std::vector<Eigen::Vector3d> vertex_normals(const std::vector<Eigen::Vector3d>& vertices,
                                            const std::vector<Eigen::Vector3i>& triangles);

}  // namespace degas
