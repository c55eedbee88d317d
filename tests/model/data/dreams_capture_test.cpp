#include "model/data/dreams_capture.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/npz.h"
#include "host/io/video.h"
#include "tests/model/data/small_capture.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

json read_json(const fs::path& path) {
  const auto bytes = read_file_bytes(path);
  return json::parse(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

/// Rewrites one array of smplx.npz.
void replace_array(const fs::path& path, const std::string& key, const NpyArray& array) {
  const NpzFile file(path);
  std::map<std::string, NpyArray> arrays;
  for (const std::string& name : file.keys()) arrays[name] = file.read(name);
  arrays[key] = array;
  write_npz(path, arrays);
}

struct SmallCapture {
  TemporaryFolder folder;
  std::vector<std::string> warnings;
  SmallCapture() { write_small_capture(folder.path()); }
  DreamsCapture open(double scale = 1) {
    CaptureOptions options;
    options.image_scale = scale;
    options.warn = [this](const std::string& text) { warnings.push_back(text); };
    return {folder.path(), options};
  }
};

}  // namespace

TEST_CASE("a written capture comes back bit for bit") {
  SmallCapture small;
  const DreamsCapture capture = small.open();
  CHECK(small.warnings.empty());  // camera 2 is listed as absent
  CHECK(capture.frame_count() == small_frames);
  CHECK(capture.camera_names() == std::vector<std::string>{"cam00", "cam01", "cam02"});
  CHECK(capture.flat_hand_mean());
  CHECK(capture.betas().size() == 300);
  CHECK(capture.betas()[1] == -1);
  CHECK_FALSE(capture.has_image(0, 2));
  for (int camera = 0; camera < small_cameras; ++camera) {
    const Camera read = capture.camera(camera), written = small_camera(camera);
    CHECK((read.rotation - written.rotation).norm() < 1e-12);
    CHECK((read.translation - written.translation).norm() < 1e-12);
    CHECK(read.cx == written.cx);
  }
  for (const int frame : {0, 5, 2}) {
    const Sample sample = capture.load(frame, 1);
    const bool same_image = sample.image.pixels == small_image(frame, 1).pixels;
    CHECK(same_image);
    CHECK(sample.mask.pixels == small_mask(frame).pixels);
    const Pose pose = capture.pose(frame), written = small_poses()[static_cast<size_t>(frame)];
    for (size_t joint = 0; joint < 55; ++joint)
      CHECK((pose.axis_angles[joint] - written.axis_angles[joint]).norm() < 1e-6);
    CHECK(pose.translation == written.translation);
    CHECK(pose.expression.size() == 100);
    CHECK(pose.expression[1] == written.expression[1]);
  }
  CHECK(capture.face_code_size() == 4);
  CHECK(capture.face_code(2, 0) == std::vector<float>{2, 1, 2, 3});
  CHECK(capture.face_code(2, 2).has_value());
  CHECK_FALSE(capture.face_code(3, 0).has_value());
  CHECK_FALSE(capture.face_code(2, 1).has_value());
}

TEST_CASE("pictures over white and whole scenes become foreground over black") {
  SmallCapture small;
  const bool white = GENERATE(true, false);
  VideoWriter writer(small.folder / "videos/cam00.mp4", 2 * small_width, small_height, 30, VideoQuality::Lossless);
  for (int frame = 0; frame < small_frames; ++frame) {
    Image8 both = Image8::black(2 * small_width, small_height, 3);
    for (int y = 0; y < small_height; ++y) {
      for (int x = 0; x < small_width; ++x) {
        const int alpha = small_alpha(frame, x, y);
        for (int c = 0; c < 3; ++c) {
          both.at(x, y)[c] =
              static_cast<uint8_t>(white ? small_image(frame, 0).at(x, y)[c] + 255 - alpha : 10 * x + 20 * c);
          both.at(small_width + x, y)[c] = static_cast<uint8_t>(alpha);
        }
      }
    }
    writer.write(both);
  }
  writer.finish();
  json description = read_json(small.folder / "capture.json");
  description["video"].erase("background");  // must be seen in the pictures
  write_text(small.folder / "capture.json", description.dump());
  const Sample sample = small.open().load(1, 0);
  CHECK(sample.mask.pixels == small_mask(1).pixels);
  if (white) {
    CHECK(sample.image.pixels == small_image(1, 0).pixels);
  } else {
    CHECK(sample.image.at(4, 5)[1] == (60 * 90 + 127) / 255);
    CHECK(sample.image.at(6, 5)[1] == 80);
    CHECK(sample.image.at(1, 5)[1] == 0);
  }
}

TEST_CASE("frame numbers and the offset choose the video's frame") {
  SmallCapture small;
  json description = read_json(small.folder / "capture.json");
  description["frame_convention"]["offset_d"] = 2;
  write_text(small.folder / "capture.json", description.dump());
  const DreamsCapture capture = small.open();
  CHECK(capture.load(1, 0).mask.pixels == small_mask(3).pixels);
  CHECK(capture.has_image(3, 0));
  CHECK_FALSE(capture.has_image(4, 0));
  REQUIRE(small.warnings.size() == 1);
  CHECK_THAT(small.warnings[0], Contains("offset_d = 2 puts 2 of 6 frames outside"));
  CHECK_THROWS_WITH(capture.load(4, 0), Contains("cam00 has no picture of frame 4"));
  CHECK_THROWS_WITH(capture.load(0, 2), Contains("cam02 has no picture of frame 0: it has no video"));
}

TEST_CASE("the image scale shrinks pictures and cameras together") {
  SmallCapture small;
  const DreamsCapture half = small.open(0.5);
  const Sample sample = half.load(0, 0);
  CHECK(sample.image.width == 11);
  CHECK(sample.image.height == 7);
  CHECK(sample.view.fx == Approx(30.0 * 11 / 21));
  CHECK(half.identity() != small.open(1).identity());
}

TEST_CASE("a camera with a lens's distortion is read without it, the others as they are") {
  SmallCapture small;
  json cameras = read_json(small.folder / "cameras.json");
  cameras["rigs"][0]["cameras"][0]["distortion"] = {-0.4, 0.1, 0.001, 0.002};
  write_text(small.folder / "cameras.json", cameras.dump());
  const DreamsCapture capture = small.open();
  CHECK_FALSE(capture.load(1, 0).mask.pixels == small_mask(1).pixels);
  CHECK(capture.load(1, 1).mask.pixels == small_mask(1).pixels);
  CHECK(capture.camera(0).fx == small_camera(0).fx);
}

TEST_CASE("what is wrong with a capture is said with file, key and remedy") {
  SmallCapture small;
  const fs::path parameters = small.folder / "smplx.npz", calibration = small.folder / "cameras.json";
  std::vector<float> values(small_frames * 63, 0.0f);

  SECTION("missing files") {
    const std::string name = GENERATE("cameras.json", "capture.json", "smplx.npz");
    fs::remove(small.folder / name);
    CHECK_THROWS_WITH(small.open(), Contains(name + ": no such file"));
  }
  SECTION("a listed camera without a video") {
    fs::remove(small.folder / "videos/cam01.mp4");
    CHECK_THROWS_WITH(small.open(), Contains("cam01.mp4: no such file, but") && Contains("cameras_present"));
  }
  SECTION("an unlisted one is skipped with one warning") {
    json description = read_json(small.folder / "capture.json");
    description.erase("cameras_present");
    write_text(small.folder / "capture.json", description.dump());
    CHECK_FALSE(small.open().has_image(0, 2));
    REQUIRE(small.warnings.size() == 1);
    CHECK_THAT(small.warnings[0], Contains("without a video are skipped: cam02"));
  }
  SECTION("a video shorter than the parameters") {
    VideoWriter writer(small.folder / "videos/cam01.mp4", 2 * small_width, small_height, 30, VideoQuality::Lossless);
    for (int i = 0; i < 4; ++i) writer.write(Image8::black(2 * small_width, small_height, 3));
    writer.finish();
    CHECK_THROWS_WITH(small.open(), Contains("cam01.mp4: has 4 frames, but") && Contains("goes to frame 5") &&
                                        Contains("first 4 rows"));
  }
  SECTION("a video of another size") {
    VideoWriter writer(small.folder / "videos/cam01.mp4", 40, small_height, 30, VideoQuality::Lossless);
    for (int i = 0; i < 6; ++i) writer.write(Image8::black(40, small_height, 3));
    writer.finish();
    CHECK_THROWS_WITH(small.open(), Contains("cam01.mp4: is 40x14"));
  }
  SECTION("NaN parameters") {
    values[63 * 2 + 5] = std::numeric_limits<float>::quiet_NaN();
    replace_array(parameters, "body_pose", NpyArray::from({small_frames, 63}, values));
    CHECK_THROWS_WITH(small.open(), Contains("smplx.npz: 'body_pose' holds nan in row 2"));
  }
  SECTION("wrong shape") {
    replace_array(parameters, "body_pose", NpyArray::from({small_frames * 63}, values));
    CHECK_THROWS_WITH(small.open(), Contains("smplx.npz: 'body_pose' has shape (378), expected (6, 63)"));
  }
  SECTION("no word on hands") {
    replace_array(parameters, "smplx_kwargs", NpyArray::from_text("{}"));
    CHECK_THROWS_WITH(small.open(), Contains("flat_hand_mean"));
  }
  SECTION("a calibration that is none") {
    json cameras = read_json(calibration);
    cameras["rigs"][1]["cameras"][0]["R"][0][0] = 5;
    write_text(calibration, cameras.dump());
    CHECK_THROWS_WITH(small.open(), Contains("cameras.json: rigs[1]: cameras[0]: R: is no rotation"));
    cameras["rigs"][1]["cameras"][0].erase("fx");
    write_text(calibration, cameras.dump());
    CHECK_THROWS_WITH(small.open(), Contains("rigs[1]: cameras[0]: has no key 'fx'"));
  }
  SECTION("a mirror, and a lens that is none") {
    json cameras = read_json(calibration);
    json& camera = cameras["rigs"][1]["cameras"][0];
    camera["distortion"] = {0.1, 0.2, 0.3};
    write_text(calibration, cameras.dump());
    CHECK_THROWS_WITH(small.open(), Contains("cameras[0]: distortion: must be k1 k2 p1 p2 [k3"));
    for (json& value : camera["R"][1]) value = -value.get<double>();
    write_text(calibration, cameras.dump());
    CHECK_THROWS_WITH(small.open(), Contains("cameras[0]: R: is a mirror, no rotation"));
  }
  SECTION("damaged JSON gives an Error, never a crash") {
    const auto good = read_file_bytes(calibration);
    std::mt19937 random(3);
    for (int round = 0; round < 200; ++round) {
      auto bad = good;
      if (round % 4 == 0)
        bad.resize(random() % bad.size());
      else
        bad[random() % bad.size()] ^= std::byte(1 << random() % 7);
      write_file_atomically(calibration, bad);
      try {
        read_dreams_cameras(calibration);
      } catch (const Error& error) {
        CHECK_THAT(error.what(), Contains("cameras.json"));
      }
    }
  }
}
