#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "model/drive/pose.h"

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

/// What smplx.npz holds, a pose a row.
struct DreamsParameters {
  std::vector<Pose> poses;
  std::vector<int64_t> frame_numbers;  ///< of the rows, rising; 0, 1, ... where the file has no 'frames'
  std::vector<double> betas;
  bool flat_hand_mean = false;
};

/// Error naming file and key for missing arrays, wrong shapes and, with the row, values that are not finite.
DreamsParameters read_dreams_parameters(const std::filesystem::path& path);

}  // namespace degas
