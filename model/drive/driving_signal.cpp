#include "model/drive/driving_signal.h"

namespace degas {
namespace {

std::vector<float> at_covered_texels(const UvAtlas& atlas, const std::vector<float>& map) {
  std::vector<float> rows;
  rows.reserve(3 * atlas.covered().size());
  for (const int texel : atlas.covered()) rows.insert(rows.end(), &map[3 * texel], &map[3 * texel] + 3);
  return rows;
}

}  // namespace

Pose driven_pose(Pose registered, FaceSignal signal) {
  const bool has_jaw = registered.axis_angles.size() > static_cast<size_t>(JawJoint);
  const bool moves_jaw = signal == FaceSignal::Expression || signal == FaceSignal::Mesh;
  if (has_jaw && !moves_jaw) registered.axis_angles[JawJoint].setZero();
  if (signal != FaceSignal::Mesh) registered.expression.assign(registered.expression.size(), 0.0);
  return registered;
}

std::vector<float> expression_code(const Pose& registered) {
  std::vector<float> code(registered.expression.begin(), registered.expression.end());
  for (const double angle : registered.axis_angles[JawJoint]) code.push_back(static_cast<float>(angle));
  return code;
}

DrivingSignal make_driving_signal(const BodyModel& body, const UvAtlas& atlas, Pose driven,
                                  const std::vector<double>& betas, std::vector<float> face_code, SignalParts parts) {
  DrivingSignal signal;
  signal.pose = std::move(driven);
  for (size_t joint = 1; joint < signal.pose.axis_angles.size(); ++joint) {
    for (double angle : signal.pose.axis_angles[joint]) signal.joint_angles.push_back(static_cast<float>(angle));
  }
  const std::vector<Eigen::Vector3d> vertices = body.posed_vertices(signal.pose, betas, false);
  signal.posed_vertex_map = atlas.map(vertices);
  signal.face_code = std::move(face_code);
  if (parts.canonical_positions) {
    signal.canonical_positions =
        at_covered_texels(atlas, atlas.map(body.canonical_vertices(betas, signal.pose.expression)));
  }
  if (!parts.world_normals) return signal;
  const Eigen::Matrix3d global_rotation = rotation_from_axis_angle(signal.pose.axis_angles[0]);
  std::vector<Eigen::Vector3d> normals = vertex_normals(body.faces(), vertices);
  for (Eigen::Vector3d& normal : normals) normal = global_rotation * normal;
  signal.world_normals = atlas.map(normals);
  return signal;
}

}  // namespace degas
