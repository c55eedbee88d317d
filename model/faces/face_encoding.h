#pragma once

#include <functional>
#include <vector>

#include "model/faces/code_folder.h"
#include "model/faces/face_boxes.h"
#include "model/faces/face_encoder.h"

namespace degas {

struct FaceEncodingSummary {
  int frames = 0;        ///< that were gone through
  int written = 0;       ///< codes
  int present = 0;       ///< codes that were there already
  int without_face = 0;  ///< frames of which no code could be made
  bool is_whole = true;  ///< false when it was stopped
};

/// Encodes the `views` most frontal faces of each frame that have a picture, and writes what is not there yet. `go_on`
/// is asked before each frame and each picture; after false, what is written stays. Throws Error naming camera and
/// frame when a code is not finite.
FaceEncodingSummary encode_faces(const Capture& capture, const FaceCrops& crops, const std::vector<int>& frames,
                                 int views, const FaceEncoder& encoder, const CodeFolder& folder,
                                 const std::function<bool(const FaceEncodingSummary&)>& go_on);

/// The square of a face at the encoder's size, black outside of the picture.
Image8 face_picture(const Image8& image, const Rectangle& square, int side);

}  // namespace degas
