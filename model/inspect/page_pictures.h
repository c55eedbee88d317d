#pragma once

#include "model/inspect/inspection.h"
#include "model/inspect/silhouette.h"

namespace degas {

/// As JPEG; the caption is HTML.
PagePicture jpeg_picture(const Image8& picture, const std::string& caption);

/// Pictures of one height in a row.
Image8 side_by_side(const std::vector<Image8>& pictures);

/// The face box of the evaluation protocol, made square, 112x112 pixels; empty where no face is in the picture.
Image8 face_crop(const Image8& picture, const BodyModel& body, const Pose& pose, const std::vector<double>& betas,
                 const Camera& view);

struct AtlasPicture {
  std::string png;  ///< 256x256: shaded by the surface's normals, the head in orange, the face region framed
  FaceRegion face_region;
};
AtlasPicture atlas_picture(const BodyModel& body);

}  // namespace degas
