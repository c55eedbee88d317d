#include <fmt/ranges.h>

#include <cmath>

#include "host/error.h"
#include "host/io/npz.h"
#include "model/body/body_model.h"

namespace degas {

using Eigen::Vector3d;

/// Fills a BodyModel from an npz, checking each array.
class BodyModelReader {
 public:
  explicit BodyModelReader(const std::filesystem::path& path) : file_(path) { body_.path_ = path; }

  BodyModel read() {
    read_template();
    read_joints();
    read_shapes();
    read_pose_shapes();
    read_regressor();
    read_weights();
    read_surface();
    read_hands();
    return std::move(body_);
  }

 private:
  Error fault(const std::string& key, const std::string& reason) const {
    return Error::format("{}: '{}' {}", file_.path().string(), key, reason);
  }

  template <typename Value>
  void check_finite(const std::string& key, const std::vector<Value>& values) const {
    for (size_t i = 0; i < values.size(); ++i) {
      if (!std::isfinite(values[i])) {
        throw fault(key, fmt::format("has {} at element {}; a body model must be finite", values[i], i));
      }
    }
  }

  std::vector<double> doubles(const std::string& key, const Shape& shape) const {
    std::vector<double> values = file_.read(key, shape).doubles();
    check_finite(key, values);
    return values;
  }

  std::vector<std::array<int, 3>> triangles(const std::string& key, int64_t count, int64_t vertices) const {
    const std::vector<int64_t> indices = file_.read(key, {count, 3}).integers();
    if (indices.empty()) throw fault(key, "has no triangles");
    std::vector<std::array<int, 3>> result(indices.size() / 3);
    for (size_t i = 0; i < indices.size(); ++i) {
      if (indices[i] < 0 || indices[i] >= vertices) {
        throw fault(
            key, fmt::format("has index {} in triangle {}; indices go from 0 to {}", indices[i], i / 3, vertices - 1));
      }
      result[i / 3][i % 3] = static_cast<int>(indices[i]);
    }
    return result;
  }

  void read_template() {
    const std::vector<double> values = doubles("v_template", {-1, 3});
    if (values.empty()) throw fault("v_template", "has no vertices");
    for (size_t i = 0; i < values.size(); i += 3) body_.template_.emplace_back(values[i], values[i + 1], values[i + 2]);
    vertices_ = body_.vertex_count();
  }

  void read_joints() {
    const NpyArray table = file_.read("kintree_table", {2, -1});
    const std::vector<int64_t> values = table.integers();
    joints_ = table.shape[1];
    if (joints_ == 0) throw fault("kintree_table", "has no joints");
    if (values[0] != -1 && values[0] != 0xffffffff) {
      throw fault("kintree_table", fmt::format("gives joint 0 the parent {}; the root's is -1 or 2^32-1", values[0]));
    }
    body_.parents_.push_back(-1);
    for (int64_t j = 1; j < joints_; ++j) {
      if (values[j] < 0 || values[j] >= j) {
        throw fault("kintree_table",
                    fmt::format("gives joint {} the parent {}; a parent comes before its child", j, values[j]));
      }
      body_.parents_.push_back(static_cast<int>(values[j]));
    }
  }

  /// Keeps the columns of a (3V, columns) basis that are not zero, each contiguous.
  BlendShapes used_columns(const std::vector<float>& basis, int64_t columns) const {
    std::vector<char> used(columns, 0);
    for (size_t i = 0; i < basis.size(); ++i) used[i % columns] |= basis[i] != 0;
    BlendShapes shapes;
    for (int64_t c = 0; c < columns; ++c) {
      if (!used[c]) continue;
      shapes.columns.push_back(static_cast<int>(c));
      for (size_t i = c; i < basis.size(); i += columns) shapes.offsets.push_back(basis[i]);
    }
    return shapes;
  }

  void read_shapes() {
    const NpyArray array = file_.read("shapedirs", {vertices_, 3, -1});
    const std::vector<float> basis = array.floats();
    check_finite("shapedirs", basis);
    const int columns = static_cast<int>(array.shape[2]);
    body_.shape_count_ = columns >= 300 ? 300 : std::min(columns, 10);
    body_.expression_count_ = columns - body_.shape_count_;
    if (columns > 0) body_.shapes_ = used_columns(basis, columns);
  }

  void read_pose_shapes() {
    const int64_t columns = 9 * (joints_ - 1);
    const NpyArray array = file_.read("posedirs");
    const bool by_vertex = array.shape == Shape{vertices_, 3, columns};
    if (!by_vertex && array.shape != Shape{columns, 3 * vertices_}) {
      throw fault("posedirs", fmt::format("has shape ({}), expected ({}, 3, {}) or ({}, {})",
                                          fmt::join(array.shape, ", "), vertices_, columns, columns, 3 * vertices_));
    }
    std::vector<float> basis = array.floats();
    check_finite("posedirs", basis);
    if (columns == 0) return;
    if (!by_vertex) {
      std::vector<float> turned(basis.size());
      for (int64_t c = 0; c < columns; ++c) {
        for (int64_t i = 0; i < 3 * vertices_; ++i) turned[i * columns + c] = basis[c * 3 * vertices_ + i];
      }
      basis.swap(turned);
    }
    body_.pose_shapes_ = used_columns(basis, columns);
  }

  void read_regressor() {
    const std::vector<double> regressor = doubles("J_regressor", {joints_, vertices_});
    const size_t shapes = body_.shapes_.columns.size();
    body_.template_joints_.assign(joints_, Vector3d::Zero());
    body_.joint_shapes_.assign(shapes * joints_, Vector3d::Zero());
    for (int64_t j = 0; j < joints_; ++j) {
      for (int64_t v = 0; v < vertices_; ++v) {
        const double share = regressor[j * vertices_ + v];
        if (share == 0) continue;
        body_.template_joints_[j] += share * body_.template_[v];
        for (size_t s = 0; s < shapes; ++s) {
          const float* offset = body_.shapes_.offsets.data() + (s * vertices_ + v) * 3;
          body_.joint_shapes_[s * joints_ + j] += share * Vector3d(offset[0], offset[1], offset[2]);
        }
      }
    }
  }

  void read_weights() {
    const std::vector<double> weights = doubles("weights", {vertices_, joints_});
    body_.weight_begins_.push_back(0);
    for (int64_t v = 0; v < vertices_; ++v) {
      double sum = 0;
      for (int64_t j = 0; j < joints_; ++j) {
        const double weight = weights[v * joints_ + j];
        if (weight < 0) throw fault("weights", fmt::format("has {} for vertex {}, joint {}", weight, v, j));
        sum += weight;
      }
      if (std::abs(sum - 1) > 1e-2) throw fault("weights", fmt::format("of vertex {} sum to {:.4g}, not to 1", v, sum));
      for (int64_t j = 0; j < joints_; ++j) {
        const double weight = weights[v * joints_ + j];
        if (weight > 0) body_.weights_.push_back({static_cast<int>(j), weight / sum});
      }
      body_.weight_begins_.push_back(static_cast<int>(body_.weights_.size()));
    }
  }

  void read_surface() {
    body_.faces_ = triangles("f", -1, vertices_);
    const std::vector<double> coordinates = doubles("vt", {-1, 2});
    for (size_t i = 0; i < coordinates.size(); i += 2) {
      if (std::abs(coordinates[i] - 0.5) > 0.501 || std::abs(coordinates[i + 1] - 0.5) > 0.501) {
        throw fault("vt", fmt::format("has ({}, {}) at {}; texture coordinates lie in 0..1", coordinates[i],
                                      coordinates[i + 1], i / 2));
      }
      body_.texture_coordinates_.emplace_back(coordinates[i], coordinates[i + 1]);
    }
    body_.texture_faces_ = triangles("ft", body_.face_count(), coordinates.size() / 2);
  }

  void read_hands() {
    if (joints_ < RightHandJoint + joints_per_hand) return;
    constexpr int angles = 3 * joints_per_hand;
    if (file_.contains("hands_meanl") || file_.contains("hands_meanr")) {
      append_angles("hands_meanl", {angles}, body_.hand_means_);
      append_angles("hands_meanr", {angles}, body_.hand_means_);
    }
    if (file_.contains("hands_componentsl") || file_.contains("hands_componentsr")) {
      append_angles("hands_componentsl", {-1, angles}, body_.hand_components_[0]);
      append_angles("hands_componentsr", {-1, angles}, body_.hand_components_[1]);
    }
  }

  void append_angles(const std::string& key, const Shape& shape, std::vector<Vector3d>& angles) const {
    const std::vector<double> values = doubles(key, shape);
    for (size_t i = 0; i < values.size(); i += 3) angles.emplace_back(values[i], values[i + 1], values[i + 2]);
  }

  NpzFile file_;
  BodyModel body_;
  int64_t vertices_ = 0, joints_ = 0;
};

BodyModel BodyModel::load(const std::filesystem::path& path) {
  return BodyModelReader(path).read();
}

}  // namespace degas
