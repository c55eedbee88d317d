#pragma once

#include <filesystem>

#include "model/train/trained_avatar.h"

namespace degas {

/// Writes one frame: `ply`, its posed splats as 3DGS viewers read them, and beside it (extension .exr) the Gaussian
/// maps in UV space, canonical pose, as float channels position.{x,y,z}, rotation.{w,x,y,z}, log_scale.{x,y,z},
/// opacity, color.{r,g,b} and covered (1 where a texel holds a Gaussian; the others are 0 there).
void export_frame(Device& device, TrainedAvatar& avatar, const Capture& capture, int frame,
                  const std::filesystem::path& ply);

}  // namespace degas
