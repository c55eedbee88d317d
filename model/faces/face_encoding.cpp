#include "model/faces/face_encoding.h"

#include <algorithm>
#include <cmath>

#include "host/error.h"

namespace degas {

Image8 face_picture(const Image8& image, const Rectangle& square, int side) {
  return resized(cropped(image, square.left, square.top, square.width, square.height), side, side);
}

FaceEncodingSummary encode_faces(const Capture& capture, const FaceCrops& crops, const std::vector<int>& frames,
                                 int views, const FaceEncoder& encoder, const CodeFolder& folder,
                                 const std::function<bool(const FaceEncodingSummary&)>& go_on) {
  FaceEncodingSummary summary;
  for (const int frame : frames) {
    const int64_t number = capture.frame_number(frame);
    int found = 0;
    for (const FaceBox& face : crops.of_frame(frame)) {
      if (found == views) break;
      if (!(summary.is_whole = go_on(summary))) return summary;
      if (!capture.has_image(frame, face.camera)) continue;
      ++found;
      if (folder.contains(number, face.camera)) {
        ++summary.present;
        continue;
      }
      const std::vector<float> code =
          encoder.code(face_picture(capture.load(frame, face.camera).image, face.box, encoder.side));
      if (!std::all_of(code.begin(), code.end(), [](float value) { return std::isfinite(value); })) {
        throw Error::format("frame {} of {}: the encoder's code is not finite; its weights, mean or scale are wrong",
                            number, capture.camera_names()[static_cast<size_t>(face.camera)]);
      }
      folder.write(number, face.camera, code);
      ++summary.written;
    }
    summary.without_face += found == 0;
    ++summary.frames;
  }
  return summary;
}

}  // namespace degas
