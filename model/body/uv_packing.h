#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace degas {

/// A triangle mesh with its texture layout.
struct TexturedMesh {
  const std::vector<Eigen::Vector3d>& vertices;
  const std::vector<std::array<int, 3>>& triangles;
  const std::vector<Eigen::Vector2d>& texture_coordinates;  ///< u, v (up)
  const std::vector<std::array<int, 3>>& texture_triangles;
};

/// Which part of the body a triangle belongs to: charts are cut where parts meet.
struct AtlasPart {
  int id = 0;
  bool is_head = false;  ///< of the part's triangles all or none
};

struct PackedAtlas {
  std::vector<Eigen::Vector2d> texture_coordinates;
  std::vector<std::array<int, 3>> texture_triangles;
};

/// Lays a mesh's charts (triangles of one part that share texture vertices) out anew, as SMPL-X's layout has it: those
/// of the head in the top-left quarter (u below 1/2, v above), the others in the rest. Charts keep their form but for
/// turns; they are sized so that the surface has the same texels per area throughout the head and throughout the rest,
/// as many as fit. Between charts remain 2 texels of 512. Deterministic. Triangles without area in texture or space are
/// carried along. parts: one a triangle.
PackedAtlas pack_atlas(const TexturedMesh& mesh, const std::vector<AtlasPart>& parts);

}  // namespace degas
