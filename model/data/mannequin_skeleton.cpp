#include <Eigen/Geometry>

#include "model/data/mannequin_body.h"
#include "model/data/mannequin_parts.h"

namespace degas {
namespace {

using Eigen::Vector3d;

/// Places the left side's joint and its mirror image at index + 1.
void set_pair(MannequinSkeleton& skeleton, int left, const Vector3d& position) {
  skeleton.joints[left] = position;
  skeleton.joints[left + 1] = Vector3d(-position.x(), position.y(), position.z());
}

}  // namespace

ArmFrame mannequin_arm_frame() {
  ArmFrame frame;
  frame.shoulder = {0.178, 1.405, -0.020};
  frame.along = Vector3d(0.66, -0.75, 0.0).normalized();
  frame.front = Vector3d(0, 0, 1);
  frame.up = frame.front.cross(frame.along).normalized();
  frame.upper_length = 0.275;
  frame.fore_length = 0.255;
  // The forearm leans a little forward, so that the elbow's bend has a side.
  frame.fore_along = (frame.along + 0.14 * frame.front).normalized();
  return frame;
}

Vector3d finger_base(int finger) {
  const ArmFrame arm = mannequin_arm_frame();
  const Vector3d wrist = arm.wrist();
  constexpr std::array<double, 4> across{0.033, 0.0115, -0.0105, -0.031}, forward{0.092, 0.096, 0.092, 0.083};
  return wrist + forward[finger] * arm.fore_along + across[finger] * arm.hand_across();
}

MannequinSkeleton mannequin_skeleton() {
  MannequinSkeleton skeleton;
  skeleton.parents = {-1, 0,  0,  0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  9,  9,  12, 13, 14, 16,
                      17, 18, 19, 15, 15, 15, 20, 25, 26, 20, 28, 29, 20, 31, 32, 20, 34, 35, 20,
                      37, 38, 21, 40, 41, 21, 43, 44, 21, 46, 47, 21, 49, 50, 21, 52, 53};
  auto& joints = skeleton.joints;
  joints[0] = {0, 0.955, -0.010};
  set_pair(skeleton, 1, {0.090, 0.895, -0.005});
  joints[3] = {0, 1.060, -0.015};
  set_pair(skeleton, 4, {0.108, 0.490, 0.000});
  joints[6] = {0, 1.170, -0.020};
  set_pair(skeleton, 7, {0.118, 0.085, -0.030});
  joints[9] = {0, 1.270, -0.020};
  set_pair(skeleton, 10, {0.128, 0.025, 0.100});
  joints[12] = {0, 1.478, -0.022};
  set_pair(skeleton, 13, {0.045, 1.415, -0.010});
  joints[15] = {0, 1.552, -0.005};
  const ArmFrame arm = mannequin_arm_frame();
  set_pair(skeleton, 16, arm.shoulder);
  set_pair(skeleton, 18, arm.elbow());
  set_pair(skeleton, 20, arm.wrist());
  joints[22] = {0, 1.594, 0.012};
  joints[23] = left_eye_center();
  joints[24] = Vector3d(-left_eye_center().x(), left_eye_center().y(), left_eye_center().z());
  // SMPL-X lists index, middle, pinky, ring, thumb; our fingers count from index to pinky.
  constexpr std::array<int, 4> first_joint{25, 28, 34, 31};
  const auto mirror = [](const Vector3d& p) { return Vector3d(-p.x(), p.y(), p.z()); };
  for (int finger = 0; finger < 5; ++finger) {
    const FingerFrame frame = finger_frame(finger);
    const int first = finger == 4 ? 37 : first_joint[finger];
    for (int k = 0; k < 3; ++k) {
      joints[first + k] = frame.base + frame.joint_at[k] * frame.along;
      joints[first + 15 + k] = mirror(joints[first + k]);
    }
  }
  return skeleton;
}

FingerFrame finger_frame(int finger) {
  const ArmFrame arm = mannequin_arm_frame();
  FingerFrame frame;
  if (finger < 4) {
    constexpr std::array<double, 4> length{0.074, 0.082, 0.076, 0.060}, spread{0.10, 0.02, -0.05, -0.13};
    frame.length = length[finger];
    frame.base = finger_base(finger);
    frame.along = (arm.fore_along + spread[finger] * arm.hand_across()).normalized();
    frame.radius = finger == 3 ? 0.0078 : 0.0090;
  } else {
    frame.length = 0.068;
    frame.base = arm.wrist() + 0.042 * arm.fore_along + 0.030 * arm.hand_across() - 0.006 * arm.hand_up();
    frame.along = (arm.fore_along + 0.62 * arm.hand_across() - 0.30 * arm.hand_up()).normalized();
    frame.radius = 0.0108;
  }
  frame.joint_at = {0.0, 0.46 * frame.length, 0.73 * frame.length};
  return frame;
}

Vector3d left_eye_center() {
  return {0.0315, 1.6385, 0.0745};
}

}  // namespace degas
