#pragma once

#include <array>

namespace degas {

/// A block of smplx.npz that fills consecutive joints: the arrays and the 55 joints are in the same order.
struct DreamsJointBlock {
  const char* key;
  int first_joint, joints;
};

inline constexpr int dreams_joints = 55;

/// SMPL-X's joint order: pelvis, 21 of the body, jaw, eyes, left hand, right hand.
inline constexpr std::array<DreamsJointBlock, 7> dreams_joint_blocks = {{{"global_orient", 0, 1},
                                                                         {"body_pose", 1, 21},
                                                                         {"jaw_pose", 22, 1},
                                                                         {"leye_pose", 23, 1},
                                                                         {"reye_pose", 24, 1},
                                                                         {"left_hand_pose", 25, 15},
                                                                         {"right_hand_pose", 40, 15}}};

}  // namespace degas
