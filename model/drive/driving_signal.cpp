#include "model/drive/driving_signal.h"

namespace degas {
Pose neutral_face(Pose pose) {
  if (pose.axis_angles.size() > static_cast<size_t>(JawJoint)) pose.axis_angles[JawJoint].setZero();
  pose.expression.assign(pose.expression.size(), 0.0);
  return pose;
}

DrivingSignal make_driving_signal(const BodyModel& body, const UvAtlas& atlas, const Pose& registered,
                                  const std::vector<double>& betas, std::vector<float> face_code) {
  DrivingSignal signal;
  signal.pose = neutral_face(registered);
  for (size_t joint = 1; joint < signal.pose.axis_angles.size(); ++joint) {
    for (double angle : signal.pose.axis_angles[joint]) signal.joint_angles.push_back(static_cast<float>(angle));
  }
  const std::vector<Eigen::Vector3d> vertices = body.posed_vertices(signal.pose, betas, false);
  signal.posed_vertex_map = atlas.map(vertices);
  const Eigen::Matrix3d global_rotation = rotation_from_axis_angle(signal.pose.axis_angles[0]);
  std::vector<Eigen::Vector3d> normals = vertex_normals(body.faces(), vertices);
  for (Eigen::Vector3d& normal : normals) normal = global_rotation * normal;
  signal.world_normals = atlas.map(normals);
  signal.face_code = std::move(face_code);
  return signal;
}

}  // namespace degas
