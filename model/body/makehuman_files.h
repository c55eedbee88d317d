#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace degas {

// The files of a MakeHuman body beside its base.obj, whose vertices they name by index. Every Error names file and key.

/// A skeleton (.mhskel, JSON). Bones by name; a bone's head is the mean of some vertices.
struct MakeHumanRig {
  struct Bone {
    std::string parent;              ///< "" for a root
    std::vector<int> head_vertices;  ///< not empty
  };
  std::map<std::string, Bone> bones;

  /// The first of `names` on the way from `bone` to the root, itself included; "" where there is none.
  std::string ancestor(const std::string& bone, const std::map<std::string, int>& names) const;
};
/// vertex_count: of the base mesh.
MakeHumanRig read_makehuman_rig(const std::filesystem::path& path, int vertex_count);

/// Skinning (.mhw, JSON): of each bone its vertices with their weights.
using MakeHumanWeights = std::map<std::string, std::vector<std::pair<int, double>>>;
MakeHumanWeights read_makehuman_weights(const std::filesystem::path& path, int vertex_count);

/// A morph target (.target, text): vertices that it moves, by how much. A file without any moves none.
using MakeHumanTarget = std::vector<std::pair<int, Eigen::Vector3d>>;
MakeHumanTarget read_makehuman_target(const std::filesystem::path& path, int vertex_count);

}  // namespace degas
