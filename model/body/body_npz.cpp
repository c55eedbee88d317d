#include "model/body/body_npz.h"

#include "host/io/npz.h"
#include "model/body/body_model.h"

namespace degas {
namespace {

constexpr int file_betas = 300, least_expressions = 100, hand_angles = 3 * joints_per_hand;

NpyArray matrix_array(const Eigen::MatrixXf& matrix) {
  const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = matrix;
  return NpyArray::from({matrix.rows(), matrix.cols()},
                        std::span<const float>(rows.data(), static_cast<size_t>(rows.size())));
}

template <int size>
NpyArray vectors_array(const std::vector<Eigen::Matrix<double, size, 1>>& vectors) {
  std::vector<float> values;
  for (const auto& vector : vectors) {
    for (int k = 0; k < size; ++k) values.push_back(static_cast<float>(vector[k]));
  }
  return NpyArray::from({static_cast<int64_t>(vectors.size()), size}, values);
}

NpyArray triangles_array(const std::vector<std::array<int, 3>>& triangles) {
  std::vector<int32_t> values;
  for (const auto& triangle : triangles) values.insert(values.end(), triangle.begin(), triangle.end());
  return NpyArray::from({static_cast<int64_t>(triangles.size()), 3}, values);
}

NpyArray shapes_array(const BodyArrays& body) {
  const auto count = static_cast<int64_t>(body.vertices.size());
  const int64_t columns = file_betas + std::max<int64_t>(least_expressions, body.expressions.cols());
  std::vector<float> values(static_cast<size_t>(3 * count * columns), 0.0F);
  for (int64_t row = 0; row < 3 * count; ++row) {
    float* at = values.data() + row * columns;
    for (Eigen::Index k = 0; k < body.shapes.cols(); ++k) at[k] = body.shapes(row, k);
    for (Eigen::Index k = 0; k < body.expressions.cols(); ++k) at[file_betas + k] = body.expressions(row, k);
  }
  return NpyArray::from({count, 3, columns}, values);
}

}  // namespace

void write_body_npz(const std::filesystem::path& path, const BodyArrays& body) {
  const auto count = static_cast<int64_t>(body.vertices.size()), joints = static_cast<int64_t>(body.parents.size());
  const int64_t pose_features = 9 * (joints - 1);
  std::vector<int64_t> tree(body.parents.begin(), body.parents.end());
  for (int64_t j = 0; j < joints; ++j) tree.push_back(j);
  std::map<std::string, NpyArray> arrays;
  arrays["v_template"] = vectors_array(body.vertices);
  arrays["shapedirs"] = shapes_array(body);
  arrays["posedirs"] = NpyArray::from({count, 3, pose_features},
                                      std::vector<float>(static_cast<size_t>(3 * count * pose_features), 0.0F));
  arrays["J_regressor"] = matrix_array(body.joint_regressor);
  arrays["weights"] = matrix_array(body.weights);
  arrays["kintree_table"] = NpyArray::from({2, joints}, tree);
  arrays["f"] = triangles_array(body.triangles);
  arrays["vt"] = vectors_array(body.texture_coordinates);
  arrays["ft"] = triangles_array(body.texture_triangles);
  for (const char* side : {"l", "r"}) {
    arrays[std::string("hands_mean") + side] = NpyArray::from({hand_angles}, std::vector<float>(hand_angles, 0.0F));
    arrays[std::string("hands_components") + side] = matrix_array(Eigen::MatrixXf::Identity(hand_angles, hand_angles));
  }
  write_npz(path, arrays);
}

}  // namespace degas
