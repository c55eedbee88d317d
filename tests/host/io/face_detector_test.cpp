#include "host/io/face_detector.h"

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/video.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

TEST_CASE("what is no detector is named") {
  const TemporaryFolder folder;
  for (const std::string name : {"text.xml", "text.onnx"}) {
    write_file_atomically(folder / name, std::vector<std::byte>(100, std::byte{'x'}));
    CHECK_THROWS_WITH(FaceDetector(folder / name), Contains(name + ": is no face detector"));
  }
  const std::string other_network = std::string(DEGAS_TEST_VECTORS) + "/io/channel_means.onnx";
  CHECK_THROWS_WITH(FaceDetector(other_network), Contains("channel_means.onnx: is no face detector that OpenCV"));
  CHECK_THROWS_WITH(FaceDetector(folder / "none.xml"), Contains("none.xml: no such file"));
}

TEST_CASE("a real face is found, a picture without one has none") {
  const std::string folder = data_path("data/real/caliscope_4cam");
  if (folder.empty()) return;
  std::filesystem::path cascade;
  try {
    cascade = FaceDetector::installed();
  } catch (const Error& error) {
    CHECK_THAT(error.what(), Contains("opencv-data") && Contains("--detector"));
    return;
  }
  FaceDetector detector(cascade);
  CHECK_FALSE(detector.find(Image8::black(200, 100, 3)));
  VideoReader video(folder + "/cam_2.mp4");
  Image8 frame;
  REQUIRE(video.read(frame));
  const std::optional<DetectedFace> face = detector.find(frame);
  REQUIRE(face);
  // Seen by eye: hair to chin is 205 .. 420, ear to ear 715 .. 870, the nose at (795, 350).
  const Rectangle& box = face->box;
  CHECK((box.left > 690 && box.left + box.width < 890));
  CHECK((box.top > 200 && box.top + box.height < 440));
  CHECK((box.left < 795 && box.left + box.width > 795 && box.top < 350 && box.top + box.height > 350));
}
