#include "tests/support/tiny_body.h"

#include "tests/support/test_devices.h"

namespace degas::test {

namespace {

constexpr int vertices = 9, joints = 55, columns = 13;

std::vector<float> random_floats(int64_t count, unsigned seed, double size) {
  const std::vector<double> values = random_values(count, seed, -size, size);
  return {values.begin(), values.end()};
}

/// (rows, columns) of non-negative numbers, about `share` of them not zero, rows summing to 1.
std::vector<double> random_shares(int rows, int row_size, unsigned seed, double share) {
  std::vector<double> values = random_values(static_cast<int64_t>(rows) * row_size, seed, 1 - 1 / share, 1);
  for (int r = 0; r < rows; ++r) {
    double sum = 0;
    for (int c = 0; c < row_size; ++c) sum += values[r * row_size + c] = std::max(0.0, values[r * row_size + c]);
    for (int c = 0; c < row_size; ++c) values[r * row_size + c] /= sum;
  }
  return values;
}

}  // namespace

std::map<std::string, NpyArray> tiny_body_arrays() {
  std::vector<double> positions;
  std::vector<float> texture;
  const std::vector<double> bumps = random_values(vertices, 1, -0.1, 0.1);
  for (int v = 0; v < vertices; ++v) {
    const int x = v % 3, y = v / 3;
    positions.insert(positions.end(), {0.5 * x, 0.5 * y, bumps[v]});
    texture.insert(texture.end(), {0.1f + 0.4f * x, 0.1f + 0.4f * y});
  }
  std::vector<int32_t> faces;
  for (int cell = 0; cell < 4; ++cell) {
    const int corner = cell % 2 + 3 * (cell / 2);
    faces.insert(faces.end(), {corner, corner + 1, corner + 4, corner, corner + 4, corner + 3});
  }
  std::vector<float> shapes = random_floats(vertices * 3 * columns, 2, 0.1);
  for (int i = 0; i < vertices * 3; ++i) shapes[i * columns + 4] = shapes[i * columns + 11] = 0;
  std::vector<int64_t> tree = {0xffffffff, 0,  0,  0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  9,  9,  12, 13, 14, 16,
                               17,         18, 19, 15, 15, 15, 20, 25, 26, 20, 28, 29, 20, 31, 32, 20, 34, 35, 20,
                               37,         38, 21, 40, 41, 21, 43, 44, 21, 46, 47, 21, 49, 50, 21, 52, 53};
  for (int j = 0; j < joints; ++j) tree.push_back(j);
  const std::vector<double> regressor = random_shares(joints, vertices, 3, 0.5);
  return {{"v_template", NpyArray::from({vertices, 3}, positions)},
          {"shapedirs", NpyArray::from({vertices, 3, columns}, shapes)},
          {"posedirs",
           NpyArray::from({vertices, 3, 9 * (joints - 1)}, random_floats(vertices * 3 * 9 * (joints - 1), 4, 0.01))},
          {"J_regressor", NpyArray::from({joints, vertices}, std::vector<float>(regressor.begin(), regressor.end()))},
          {"kintree_table", NpyArray::from({2, joints}, tree)},
          {"weights", NpyArray::from({vertices, joints}, random_shares(vertices, joints, 5, 0.1))},
          {"f", NpyArray::from({8, 3}, faces)},
          {"vt", NpyArray::from({vertices, 2}, texture)},
          {"ft", NpyArray::from({8, 3}, faces)},
          {"hands_meanl", NpyArray::from({45}, random_floats(45, 6, 0.5))},
          {"hands_meanr", NpyArray::from({45}, random_floats(45, 7, 0.5))},
          {"hands_componentsl", NpyArray::from({45, 45}, random_floats(45 * 45, 8, 0.3))},
          {"hands_componentsr", NpyArray::from({45, 45}, random_floats(45 * 45, 9, 0.3))}};
}

void write_tiny_body(const std::filesystem::path& path) {
  write_npz(path, tiny_body_arrays());
}

}  // namespace degas::test
