#include "model/body/body_npz.h"
#include "model/data/mannequin_body.h"

namespace degas {
namespace {

std::vector<std::array<int, 3>> plain_triangles(const std::vector<Eigen::Vector3i>& triangles) {
  std::vector<std::array<int, 3>> plain;
  for (const Eigen::Vector3i& triangle : triangles) plain.push_back({triangle[0], triangle[1], triangle[2]});
  return plain;
}

}  // namespace

void write_mannequin_body(const std::filesystem::path& path, const MannequinBody& body) {
  BodyArrays arrays;
  arrays.vertices = body.mesh.vertices;
  arrays.triangles = plain_triangles(body.mesh.triangles);
  arrays.texture_coordinates = body.mesh.texture_vertices;
  arrays.texture_triangles = plain_triangles(body.mesh.texture_triangles);
  arrays.parents.assign(body.skeleton.parents.begin(), body.skeleton.parents.end());
  arrays.weights = body.weights;
  arrays.joint_regressor = body.joint_regressor;
  arrays.shapes = body.shapes;
  arrays.expressions = body.expressions;
  write_body_npz(path, arrays);
}

}  // namespace degas
