#include "model/body/body_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "host/error.h"

namespace degas {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

void add_column(std::vector<Vector3d>& vertices, const BlendShapes& shapes, size_t column, double amount) {
  if (amount == 0) return;
  const float* offset = shapes.offsets.data() + column * vertices.size() * 3;
  for (Vector3d& vertex : vertices) {
    vertex += amount * Vector3d(offset[0], offset[1], offset[2]);
    offset += 3;
  }
}

/// The coefficient of a column of shapedirs: betas first, then expression from `shape_count` on.
double coefficient(int column, int shape_count, const std::vector<double>& betas,
                   const std::vector<double>& expression) {
  const std::vector<double>& values = column < shape_count ? betas : expression;
  const size_t index = column < shape_count ? column : column - shape_count;
  return index < values.size() ? values[index] : 0;
}

void check_coefficients(const std::filesystem::path& path, const char* kind, const std::vector<double>& values,
                        int count) {
  for (size_t i = count; i < values.size(); ++i) {
    if (values[i] != 0) {
      throw Error::format(
          "{}: 'shapedirs' has {} {} columns, but coefficient {} of the capture is {}; take the body "
          "model that the capture was fitted with",
          path.string(), count, kind, i, values[i]);
    }
  }
}

}  // namespace

Matrix3d rotation_from_axis_angle(const Vector3d& axis_angle) {
  const double angle = axis_angle.norm();
  if (angle < 1e-12) {
    Matrix3d rotation = Matrix3d::Identity();
    rotation(2, 1) = axis_angle.x(), rotation(1, 2) = -axis_angle.x();
    rotation(0, 2) = axis_angle.y(), rotation(2, 0) = -axis_angle.y();
    rotation(1, 0) = axis_angle.z(), rotation(0, 1) = -axis_angle.z();
    return rotation;
  }
  return Eigen::AngleAxisd(angle, axis_angle / angle).toRotationMatrix();
}

std::vector<Vector3d> vertex_normals(const std::vector<std::array<int, 3>>& faces,
                                     const std::vector<Vector3d>& vertices) {
  std::vector<Vector3d> normals(vertices.size(), Vector3d::Zero());
  for (const std::array<int, 3>& face : faces) {
    const Vector3d corner = vertices[face[0]];
    const Vector3d twice_area = (vertices[face[1]] - corner).cross(vertices[face[2]] - corner);
    for (const int vertex : face) normals[vertex] += twice_area;
  }
  for (Vector3d& normal : normals) normal.normalize();
  return normals;
}

void BodyModel::check(const Pose& pose) const {
  if (static_cast<int>(pose.axis_angles.size()) != joint_count()) {
    throw Error::format(
        "{}: 'kintree_table' has {} joints, but the pose has {}; take the body model that the capture "
        "was fitted with",
        path_.string(), joint_count(), pose.axis_angles.size());
  }
}

void BodyModel::add_shapes(std::vector<Vector3d>& vertices, const std::vector<double>& betas,
                           const std::vector<double>& expression) const {
  check_coefficients(path_, "shape", betas, shape_count_);
  check_coefficients(path_, "expression", expression, expression_count_);
  for (size_t i = 0; i < shapes_.columns.size(); ++i) {
    add_column(vertices, shapes_, i, coefficient(shapes_.columns[i], shape_count_, betas, expression));
  }
}

std::vector<Vector3d> BodyModel::canonical_vertices(const std::vector<double>& betas,
                                                    const std::vector<double>& expression) const {
  std::vector<Vector3d> vertices = template_;
  add_shapes(vertices, betas, expression);
  return vertices;
}

std::vector<Vector3d> BodyModel::joints(const std::vector<double>& betas) const {
  // Regression is linear: the regressed template plus each shape's regressed offsets.
  check_coefficients(path_, "shape", betas, shape_count_);
  std::vector<Vector3d> joints = template_joints_;
  for (size_t i = 0; i < shapes_.columns.size(); ++i) {
    const double amount = coefficient(shapes_.columns[i], shape_count_, betas, {});
    if (amount == 0) continue;
    for (size_t j = 0; j < joints.size(); ++j) joints[j] += amount * joint_shapes_[i * joints.size() + j];
  }
  return joints;
}

JointFrames BodyModel::frames(const Pose& pose, const std::vector<Vector3d>& rest, bool include_global) const {
  JointFrames frames;
  frames.rotations.resize(rest.size());
  frames.positions.resize(rest.size());
  frames.rotations[0] = include_global ? rotation_from_axis_angle(pose.axis_angles[0]) : Matrix3d::Identity();
  frames.positions[0] = include_global ? Vector3d(rest[0] + pose.translation) : rest[0];
  for (size_t j = 1; j < rest.size(); ++j) {
    const int parent = parents_[j];
    frames.rotations[j] = frames.rotations[parent] * rotation_from_axis_angle(pose.axis_angles[j]);
    frames.positions[j] = frames.positions[parent] + frames.rotations[parent] * (rest[j] - rest[parent]);
  }
  return frames;
}

JointFrames BodyModel::posed_joints(const Pose& pose, const std::vector<double>& betas) const {
  check(pose);
  return frames(pose, joints(betas), true);
}

void BodyModel::add_pose_shapes(std::vector<Vector3d>& vertices, const Pose& pose) const {
  const Eigen::Index columns = pose_shapes_.columns.size();
  if (columns == 0) return;
  Eigen::VectorXf features(columns);
  for (Eigen::Index i = 0; i < columns; ++i) {
    // Column 9 (j - 1) + 3 row + column holds that entry of joint j's R - I.
    const int entry = pose_shapes_.columns[i] % 9, joint = pose_shapes_.columns[i] / 9 + 1;
    const Matrix3d feature = rotation_from_axis_angle(pose.axis_angles[joint]) - Matrix3d::Identity();
    features[i] = static_cast<float>(feature(entry / 3, entry % 3));
  }
  // Single precision: the basis is (it streams from memory, 60 MB for SMPL-X), and offsets are centimetres.
  const Eigen::Map<const Eigen::MatrixXf> basis(pose_shapes_.offsets.data(), 3 * vertex_count(), columns);
  const Eigen::VectorXf offsets = basis * features;
  for (int v = 0; v < vertex_count(); ++v) vertices[v] += offsets.segment<3>(3 * v).cast<double>();
}

std::vector<Vector3d> BodyModel::posed_vertices(const Pose& pose, const std::vector<double>& betas,
                                                bool include_global) const {
  check(pose);
  const std::vector<Vector3d> rest = joints(betas);
  std::vector<Vector3d> vertices = canonical_vertices(betas, pose.expression);
  add_pose_shapes(vertices, pose);
  const JointFrames posed = frames(pose, rest, include_global);
  std::vector<Eigen::Matrix<double, 3, 4>> transforms(rest.size());  // posed * inverse(rest)
  for (size_t j = 0; j < rest.size(); ++j) {
    transforms[j].leftCols<3>() = posed.rotations[j];
    transforms[j].col(3) = posed.positions[j] - posed.rotations[j] * rest[j];
  }
  for (int v = 0; v < vertex_count(); ++v) {
    Eigen::Matrix<double, 3, 4> blend = Eigen::Matrix<double, 3, 4>::Zero();
    for (const JointWeight& share : skinning_weights(v)) blend += share.weight * transforms[share.joint];
    vertices[v] = (blend.leftCols<3>() * vertices[v] + blend.col(3)).eval();
  }
  return vertices;
}

void BodyModel::expand_hand(Pose& pose, int hand) const {
  std::vector<double>& coefficients = pose.hand_coefficients[hand];
  const std::vector<Vector3d>& components = hand_components_[hand];
  const size_t count = components.size() / joints_per_hand;
  if (coefficients.size() > count) {
    throw Error::format(
        "{}: 'hands_components{}' {}, but the capture's fingers are {} coefficients of principal components; take the "
        "body model that it was fitted with",
        path_.string(), hand == 0 ? 'l' : 'r', count == 0 ? "is missing" : fmt::format("has {} rows", count),
        coefficients.size());
  }
  const int first_joint = hand == 0 ? LeftHandJoint : RightHandJoint;
  for (size_t i = 0; i < coefficients.size(); ++i) {
    for (int joint = 0; joint < joints_per_hand; ++joint) {
      pose.axis_angles[first_joint + joint] += coefficients[i] * components[i * joints_per_hand + joint];
    }
  }
  coefficients.clear();
}

Pose BodyModel::with_hands(Pose pose, bool flat_hand_mean) const {
  check(pose);
  for (const int hand : {0, 1}) expand_hand(pose, hand);
  if (flat_hand_mean) return pose;
  if (hand_means_.empty()) {
    throw Error::format(
        "{}: no 'hands_meanl' and 'hands_meanr', but the capture's finger angles are relative to the "
        "mean hand (flat_hand_mean is false); take the body model that it was fitted with",
        path_.string());
  }
  for (int i = 0; i < 2 * joints_per_hand; ++i) pose.axis_angles[LeftHandJoint + i] += hand_means_[i];
  return pose;
}

std::vector<int> BodyModel::vertices_of(std::initializer_list<int> joints) const {
  std::vector<int> vertices;
  for (int v = 0; v < vertex_count(); ++v) {
    double sum = 0;
    for (const JointWeight& share : skinning_weights(v)) {
      if (std::find(joints.begin(), joints.end(), share.joint) != joints.end()) sum += share.weight;
    }
    if (sum > 0.5) vertices.push_back(v);
  }
  return vertices;
}

double frontal_angle(const BodyModel& body, const Pose& pose, const std::vector<double>& betas, const Vector3d& from) {
  const JointFrames frames = body.posed_joints(pose, betas);
  const Vector3d forward = frames.rotations[HeadJoint] * Vector3d::UnitZ();  // the rest pose faces +Z
  const Vector3d to_viewer = (from - frames.positions[HeadJoint]).normalized();
  return std::acos(std::clamp(forward.dot(to_viewer), -1.0, 1.0));
}

}  // namespace degas
