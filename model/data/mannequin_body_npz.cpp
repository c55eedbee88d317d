#include "host/io/npz.h"
#include "model/data/mannequin_body.h"

namespace degas {
namespace {

/// Blend shapes of the SMPL-X layout: 300 betas, then 100 expressions.
constexpr int file_betas = 300, file_expressions = 100, pose_features = 486;

template <typename Matrix>
std::vector<float> row_major(const Matrix& matrix) {
  std::vector<float> values;
  values.reserve(static_cast<size_t>(matrix.size()));
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) values.push_back(matrix(row, column));
  }
  return values;
}

NpyArray triangles_array(const std::vector<Eigen::Vector3i>& triangles) {
  std::vector<int32_t> values;
  for (const auto& triangle : triangles) values.insert(values.end(), triangle.data(), triangle.data() + 3);
  return NpyArray::from({static_cast<int64_t>(triangles.size()), 3}, values);
}

}  // namespace

void write_mannequin_body(const std::filesystem::path& path, const MannequinBody& body) {
  const auto count = static_cast<int64_t>(body.mesh.vertices.size());
  std::map<std::string, NpyArray> arrays;
  std::vector<float> vertices, texture;
  for (const auto& p : body.mesh.vertices) {
    for (int k = 0; k < 3; ++k) vertices.push_back(static_cast<float>(p[k]));
  }
  for (const auto& uv : body.mesh.texture_vertices) {
    for (int k = 0; k < 2; ++k) texture.push_back(static_cast<float>(uv[k]));
  }
  constexpr int columns = file_betas + file_expressions;
  std::vector<float> shapes(static_cast<size_t>(3 * count) * columns, 0.0F);
  for (int64_t row = 0; row < 3 * count; ++row) {
    float* at = shapes.data() + row * columns;
    for (int k = 0; k < mannequin_shape_count; ++k) at[k] = body.shapes(row, k);
    for (int k = 0; k < mannequin_expression_count; ++k) at[file_betas + k] = body.expressions(row, k);
  }
  std::vector<int64_t> tree(2 * mannequin_joint_count);
  for (int j = 0; j < mannequin_joint_count; ++j) {
    tree[j] = body.skeleton.parents[j];
    tree[mannequin_joint_count + j] = j;
  }
  std::vector<float> identity(45 * 45, 0.0F);
  for (int k = 0; k < 45; ++k) identity[46 * k] = 1;
  const std::vector<float> flat(45, 0.0F);
  arrays["v_template"] = NpyArray::from({count, 3}, vertices);
  arrays["shapedirs"] = NpyArray::from({count, 3, columns}, shapes);
  arrays["posedirs"] = NpyArray::from({count, 3, pose_features},
                                      std::vector<float>(static_cast<size_t>(3 * count) * pose_features, 0.0F));
  arrays["J_regressor"] = NpyArray::from({mannequin_joint_count, count}, row_major(body.joint_regressor));
  arrays["weights"] = NpyArray::from({count, mannequin_joint_count}, row_major(body.weights));
  arrays["kintree_table"] = NpyArray::from({2, mannequin_joint_count}, tree);
  arrays["f"] = triangles_array(body.mesh.triangles);
  arrays["vt"] = NpyArray::from({static_cast<int64_t>(body.mesh.texture_vertices.size()), 2}, texture);
  arrays["ft"] = triangles_array(body.mesh.texture_triangles);
  for (const char* side : {"l", "r"}) {
    arrays[std::string("hands_mean") + side] = NpyArray::from({45}, flat);
    arrays[std::string("hands_components") + side] = NpyArray::from({45, 45}, identity);
  }
  write_npz(path, arrays);
}

}  // namespace degas
