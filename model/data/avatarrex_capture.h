#pragma once

#include "model/data/picture_capture.h"

namespace degas {

/// Does the folder hold calibration_full.json (AvatarReX) or calibration.json (THuman4)?
bool is_avatarrex(const std::filesystem::path& folder);

/// The layouts of AvatarReX ({camera}/%08d.jpg, {camera}/mask/pha/%08d.jpg) and THuman4 (images/{camera}/%08d.jpg,
/// masks/{camera}/%08d.jpg) with smpl_params.npz. The calibration is OpenCV's, world to camera: {camera: {K 9, R 9,
/// T 3, distCoeff, imgSize (w, h)}}, pixel centres at whole numbers; cameras keep its order. Views that
/// missing_img_files.txt or missing_msk_files.txt list (paths through {camera}/ to {frame}.jpg) are left out. Masks are
/// cut at 128, hands relative to the flat hand unless the parameters say otherwise. Error naming file, camera, key and
/// value of what is wrong with the calibration, or file and line of a list.
PictureLayout find_avatarrex_layout(const std::filesystem::path& folder);

}  // namespace degas
