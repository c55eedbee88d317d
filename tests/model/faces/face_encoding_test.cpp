#include "model/faces/face_encoding.h"

#include <limits>

#include "host/error.h"
#include "model/data/dreams_codes.h"
#include "tests/support/catch.h"
#include "tests/support/training_scene.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

bool always(const FaceEncodingSummary&) {
  return true;
}

/// Frames 0 to 5 of the scene, cameras 0, 1 and 3 by rising rank; the code tells the picture's mean.
FaceCrops crops_of_all() {
  std::vector<FaceBox> faces;
  for (int frame = 0; frame < 6; ++frame) {
    for (const int camera : {0, 1, 3}) faces.push_back({frame, camera, {20, 5, 24, 24}, 0.1 * camera});
  }
  return FaceCrops(faces, {2});
}

FaceEncoder mean_encoder() {
  FaceEncoder encoder;
  encoder.side = 16;
  encoder.code = [](const Image8& face) {
    CHECK((face.width == 16 && face.height == 16));
    float total = 0;
    for (const uint8_t value : face.pixels) total += value;
    return std::vector<float>{total, 1};
  };
  return encoder;
}

}  // namespace

TEST_CASE("the most frontal views that have a picture are encoded, once") {
  ChangedCapture capture;
  capture.lacks_image = [](int frame, int camera) { return (frame == 1 && camera == 0) || frame == 4; };
  const TemporaryFolder place;
  const CodeFolder folder(place.path(), {{"margin", 2}}, false);
  folder.begin();
  const FaceEncodingSummary first = encode_faces(capture, crops_of_all(), {0, 1, 4}, 2, mean_encoder(), folder, always);
  CHECK(first.written == 4);
  CHECK(first.present == 0);
  CHECK(first.without_face == 1);
  CHECK(first.is_whole);
  CHECK((folder.contains(0, 0) && folder.contains(0, 1) && folder.contains(1, 1) && folder.contains(1, 3)));
  CHECK_FALSE((folder.contains(0, 3) || folder.contains(1, 0) || folder.contains(4, 0)));
  const FaceEncodingSummary second =
      encode_faces(capture, crops_of_all(), {0, 1, 2}, 2, mean_encoder(), folder, always);
  CHECK(second.written == 2);
  CHECK(second.present == 4);

  const DreamsCodes codes(place.path(), {0, 1, 2, 3, 4, 5}, 5);
  CHECK(codes.size() == 2);
  const Image8 face = face_picture(capture.load(1, 3).image, crops_of_all().of_frame(1).at(2).box, 16);
  CHECK(codes.code(1, 3) == mean_encoder().code(face));
}

TEST_CASE("a stopped run keeps what it wrote") {
  const auto capture = open_scene();
  const TemporaryFolder place;
  const CodeFolder folder(place.path(), {}, false);
  const FaceEncodingSummary summary =
      encode_faces(*capture, crops_of_all(), {0, 1, 2}, 3, mean_encoder(), folder,
                   [](const FaceEncodingSummary& so_far) { return so_far.written < 4; });
  CHECK_FALSE(summary.is_whole);
  CHECK(summary.written == 4);
  CHECK(summary.frames == 1);
  CHECK(folder.contains(1, 0));
  CHECK_FALSE(folder.contains(1, 1));
}

TEST_CASE("a code that is not finite is refused with its view") {
  const auto capture = open_scene();
  const TemporaryFolder place;
  FaceEncoder encoder = mean_encoder();
  encoder.code = [](const Image8&) { return std::vector<float>{std::numeric_limits<float>::quiet_NaN()}; };
  CHECK_THROWS_WITH(
      encode_faces(*capture, crops_of_all(), {2}, 1, encoder, CodeFolder(place.path(), {}, false), always),
      Contains("frame 2 of cam00: the encoder's code is not finite"));
}

TEST_CASE("a face picture is black where it reaches out of the picture") {
  Image8 image = Image8::black(4, 4, 3);
  std::fill(image.pixels.begin(), image.pixels.end(), uint8_t{200});
  const Image8 face = face_picture(image, {-4, 0, 8, 8}, 4);
  CHECK(*face.at(0, 0) == 0);
  CHECK(*face.at(2, 0) == 200);
  CHECK(*face.at(3, 1) == 200);
  CHECK(*face.at(3, 2) == 0);
}
