#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/io/npy.h"
#include "model/data/capture.h"
#include "model/drive/pose.h"

namespace degas {

/// An array of a parameters file that fills consecutive joints: the arrays and the 55 joints are in the same order.
struct SmplxJointBlock {
  const char* key;
  int first_joint, joints;
};

inline constexpr int smplx_joints = 55;

/// SMPL-X's joint order: pelvis, 21 of the body, jaw, eyes, left hand, right hand.
inline constexpr std::array<SmplxJointBlock, 7> smplx_joint_blocks = {{{"global_orient", 0, 1},
                                                                       {"body_pose", 1, 21},
                                                                       {"jaw_pose", 22, 1},
                                                                       {"leye_pose", 23, 1},
                                                                       {"reye_pose", 24, 1},
                                                                       {"left_hand_pose", 25, 15},
                                                                       {"right_hand_pose", 40, 15}}};

/// What a file of body parameters holds (smplx.npz, smpl_params.npz), a pose a row.
struct SmplxParameters {
  std::vector<Pose> poses;
  std::vector<int64_t> frame_numbers;  ///< of the rows, rising; 0, 1, ... where the file has no 'frames'
  std::vector<double> betas;
  bool flat_hand_mean = false;
};

/// What a format leaves unsaid in its files.
struct SmplxConventions {
  bool has_eye_poses = true;           ///< false: eyes look straight ahead where the file has no arrays for them
  std::optional<bool> flat_hand_mean;  ///< of hands whose file does not tell; nothing: the file must
};

/// Hands of fewer than 45 columns are coefficients of principal components. 'betas' are the person's shape, once or for
/// each row; of rows that differ it is their mean, and `warn` is told. Error naming file and key for missing
/// arrays, wrong shapes and, with the row, values that are not finite.
SmplxParameters read_smplx_parameters(const std::filesystem::path& path, const SmplxConventions& conventions = {},
                                      const std::function<void(const std::string&)>& warn = print_warning);

/// The arrays of such a file (write_npz), hands by angles. Poses have 55 joints, and expressions of one length.
std::map<std::string, NpyArray> smplx_arrays(const SmplxParameters& parameters);

}  // namespace degas
