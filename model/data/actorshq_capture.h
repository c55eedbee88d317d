#pragma once

#include "model/data/picture_capture.h"

namespace degas {

/// Folders at or below `folder` (three levels, as in Actor01/Sequence1/1x) that hold an ActorsHQ capture: a
/// calibration.csv and rgbs/. Folders that may not be read are passed over.
std::vector<std::filesystem::path> find_actorshq(const std::filesystem::path& folder);

/// The ActorsHQ layout: calibration.csv (name,w,h,rx,ry,rz,tx,ty,tz,fx,fy,px,py: axis-angle camera to world and the
/// camera's centre in metres; fx, px in widths and fy, py in heights of the picture), rgbs/CamNNN/CamNNN_rgb%06d.jpg,
/// masks/CamNNN/CamNNN_mask%06d.png, and smpl_params.npz here or in the folder above. Cameras keep their names.
/// Hands are relative to the flat hand unless the parameters say otherwise. Error naming the file, row, column and
/// value of what is wrong with the calibration, or the captures there are where the folder holds several.
PictureLayout find_actorshq_layout(const std::filesystem::path& folder);

}  // namespace degas
