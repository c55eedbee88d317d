#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace degas::test {

/// A made-up person in MakeHuman's files, written to a folder: base.obj, rig.mhskel, weights.mhw, shape.target and
/// targets/*.target. Each bone that SMPL-X's joints go by has a tube of 8 vertices and 4 quads with a chart of its own;
/// helpers lie between them in the file.
struct TinyMakeHuman {
  explicit TinyMakeHuman(const std::filesystem::path& folder);

  std::filesystem::path base, rig, weights, shape, targets;
  std::vector<std::string> bones;                  ///< of the tubes, in the file's order
  std::map<std::string, std::string> parents;      ///< of bones; also of some without a tube
  std::map<std::string, Eigen::Vector3d> middles;  ///< of the tubes, in the file's units: the bones' heads
  std::map<std::string, int> first_vertex;         ///< of each bone's tube in base.obj
  Eigen::Vector3d shape_offset;                    ///< by which shape.target moves every vertex
};

}  // namespace degas::test
