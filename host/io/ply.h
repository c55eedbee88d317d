#pragma once

#include <filesystem>
#include <vector>

namespace degas {

/// Gaussians as 3DGS viewers store them; one posed frame of an avatar.
struct PlySplats {
  std::vector<float> positions;       ///< (N,3) metres
  std::vector<float> color_dc;        ///< (N,3) colour = max(0, 0.5 + 0.28209479 * this)
  std::vector<float> harmonics;       ///< (N,K,3) of degrees 1 and up, K = 0, 3, 8 or 15, in the world's axes
  std::vector<float> opacity_logits;  ///< (N)
  std::vector<float> log_scales;      ///< (N,3) natural logarithm of metres
  std::vector<float> rotations;       ///< (N,4) quaternions w x y z
};

/// Binary little-endian PLY with x y z nx ny nz f_dc_0..2 f_rest_0..3K-1 opacity scale_0..2 rot_0..3 (normals 0),
/// written under a temporary name, then renamed.
void write_ply(const std::filesystem::path& path, const PlySplats& splats);
/// Reads that layout back, in any order of float properties, others (normals) passed over. Error naming file and
/// property for what is missing, of another type, or cut short.
PlySplats read_ply(const std::filesystem::path& path);

}  // namespace degas
