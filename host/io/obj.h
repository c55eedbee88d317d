#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace degas {

/// A polygon mesh as a Wavefront .obj holds it; indices count from 0.
struct ObjMesh {
  struct Corner {
    int vertex, texture;  ///< texture: -1 where the file gives none
  };
  struct Polygon {
    int first, count;  ///< its corners: three or more
    int group;         ///< into groups
  };
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector2d> texture_coordinates;  ///< u, v (up)
  std::vector<Polygon> polygons;
  std::vector<Corner> corners;
  std::vector<std::string> groups;  ///< names in order of appearance; the first is "" (before any `g`)
};

/// Reads `v`, `vt`, `f` (v, v/vt, v/vt/vn, v//vn; negative indices count from the end) and `g` (its first name); other
/// lines are passed over. Error naming file and line for numbers that are none or not finite and indices out of range.
ObjMesh read_obj(const std::filesystem::path& path);

}  // namespace degas
