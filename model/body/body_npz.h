#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <vector>

namespace degas {

/// The arrays of a body model that is made here: V vertices, J joints, metres.
struct BodyArrays {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;         ///< counter-clockwise seen from outside
  std::vector<Eigen::Vector2d> texture_coordinates;  ///< u, v (up), 0..1
  std::vector<std::array<int, 3>> texture_triangles;
  std::vector<int> parents;         ///< -1 for joint 0
  Eigen::MatrixXf weights;          ///< (V, J), rows sum to 1
  Eigen::MatrixXf joint_regressor;  ///< (J, V), rows sum to 1
  Eigen::MatrixXf shapes;           ///< (3V, at most 300) betas
  Eigen::MatrixXf expressions;      ///< (3V, E)
};

/// Writes SMPL-X's npz (docs/bodies.md): 300 columns of betas, then at least 100
/// of expression; posedirs are zero, the hand components the identity, the mean hand is flat.
void write_body_npz(const std::filesystem::path& path, const BodyArrays& body);

}  // namespace degas
