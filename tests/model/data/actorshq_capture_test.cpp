#include "model/data/actorshq_capture.h"

#include <cmath>
#include <limits>
#include <random>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "tests/model/data/small_picture_capture.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

struct SmallActorsHq {
  TemporaryFolder folder;
  fs::path scale = write_small_actorshq(folder.path());
  std::vector<std::string> warnings;

  std::unique_ptr<Capture> open(CaptureOptions options = {}) {
    options.warn = [this](const std::string& text) { warnings.push_back(text); };
    return open_uncached_capture(folder.path(), options);
  }
  std::string calibration() const {
    const auto bytes = read_file_bytes(scale / "calibration.csv");
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  void change_calibration(const std::string& from, const std::string& to) {
    std::string text = calibration();
    REQUIRE(text.find(from) != std::string::npos);
    write_text_file(scale / "calibration.csv", text.replace(text.find(from), from.size(), to));
  }
};

}  // namespace

TEST_CASE("an ActorsHQ capture is found below its root and read by name") {
  SmallActorsHq small;
  const auto capture = small.open();
  CHECK(capture->camera_names() == std::vector<std::string>{"Cam001", "Cam002", "Cam003"});
  CHECK(capture->frame_count() == small_frames);
  CHECK(capture->flat_hand_mean());
  CHECK(capture->betas() == std::vector<double>(10, 0.5));
  CHECK(capture->face_code_size() == 0);
  CHECK_FALSE(capture->has_image(0, 2));
  REQUIRE(small.warnings.size() == 1);
  CHECK_THAT(small.warnings[0], Contains("cameras without pictures are skipped: Cam003"));
  for (int camera = 0; camera < small_cameras; ++camera) {
    const Camera read = capture->camera(camera), written = small_camera(camera);
    CHECK((read.rotation - written.rotation).norm() < 1e-9);
    CHECK((read.translation - written.translation).norm() < 1e-9);
    CHECK(read.fx == Approx(written.fx));
    CHECK(read.cx == Approx(written.cx));
    CHECK(read.cy == Approx(written.cy));
  }
  for (const int frame : {0, 5, 2}) {
    const Sample sample = capture->load(frame, 1);
    const bool same = sample.image.pixels == small_image(frame, 1).pixels;
    CHECK(same);
    CHECK(sample.mask.pixels == small_mask(frame).pixels);
    const Pose pose = capture->pose(frame), written = small_poses()[static_cast<size_t>(frame)];
    for (size_t joint = 0; joint < 55; ++joint) {
      const bool is_eye = joint == 23 || joint == 24;
      const Eigen::Vector3d expected = is_eye ? Eigen::Vector3d::Zero() : written.axis_angles[joint];
      CHECK((pose.axis_angles[joint] - expected).norm() < 1e-6);
    }
    CHECK(pose.expression.size() == 10);
  }
  // The same folder by its full name and format.
  CaptureOptions options;
  options.format = "actorshq";
  options.warn = [](const std::string&) {};
  for (const fs::path& name : {small.scale, small.scale / "", small.scale / "."}) {
    CAPTURE(name);
    CHECK(open_uncached_capture(name, options)->frame_count() == small_frames);
  }
  CHECK(open_uncached_capture(small.scale, options)->identity() == capture->identity());
}

TEST_CASE("folders that may not be read are passed over in the search for an ActorsHQ capture") {
  // Also for the superuser: the folder can be named, but no file of it in the 4095 bytes that a path may have.
  const TemporaryFolder folder;
  constexpr size_t length = 4085;
  fs::path path = folder.path();
  while (path.native().size() + 253 <= length) path /= std::string(250, 'x');
  path /= std::string(length - path.native().size() - 1, 'x');
  fs::create_directories(path);
  CHECK_THROWS_AS(fs::is_regular_file(path / "calibration.csv"), fs::filesystem_error);
  CHECK(find_actorshq(path.parent_path()).empty());
}

TEST_CASE("a damaged first picture leaves the others") {
  SmallActorsHq small;
  const auto damage = [&](int frame, int camera) {
    write_text_file(small.scale / fmt::format("rgbs/Cam00{0}/Cam00{0}_rgb{1:06}.png", camera + 1, frame), "no picture");
  };
  const std::vector<uint8_t> expected = small.open()->load(1, 0).image.pixels;
  damage(0, 0);
  const auto capture = small.open();
  CHECK(capture->load(1, 0).image.pixels == expected);
  CHECK_THROWS_WITH(capture->load(0, 0), Contains("Cam001_rgb000000.png: is no picture"));
  for (int frame = 0; frame < small_frames; ++frame) {
    for (int camera = 0; camera < 2; ++camera) damage(frame, camera);
  }
  CHECK_THROWS_WITH(small.open(), Contains("Cam001_rgb000000.png: is no picture"));
}

TEST_CASE("pictures at another scale have cameras to match and an identity of their own") {
  SmallActorsHq small;
  CaptureOptions half;
  half.image_scale = 0.5;
  const auto capture = small.open(half);
  const Sample sample = capture->load(0, 0);
  CHECK(sample.image.width == 11);
  CHECK(sample.view.cx == Approx(9.5 * 11 / 21));
  CHECK(capture->identity() != small.open()->identity());
  // Any file that changes makes another capture of it.
  const std::string before = small.open()->identity();
  const fs::path picture = small.scale / "masks/Cam002/Cam002_mask000003.png";
  fs::last_write_time(picture, fs::last_write_time(picture) + std::chrono::seconds(2));
  CHECK(small.open()->identity() != before);
}

TEST_CASE("what is missing is skipped with a warning") {
  SmallActorsHq small;
  fs::remove(small.scale / "masks/Cam002/Cam002_mask000003.png");
  fs::remove(small.scale / "rgbs/Cam002/Cam002_rgb000005.png");
  const auto capture = small.open();
  REQUIRE(small.warnings.size() == 2);
  CHECK_THAT(small.warnings[1], Contains("of 6 frames, so many lack a picture or a mask and are skipped: Cam002 2"));
  CHECK(capture->has_image(3, 0));
  CHECK_FALSE(capture->has_image(3, 1));
  CHECK_THROWS_WITH(capture->load(3, 1), Contains("Cam002 has no picture of frame 3: it has no mask"));
  CHECK_THROWS_WITH(capture->load(5, 1),
                    Contains("Cam002_rgb000005.png: Cam002 has no picture of frame 5: there is no"));
  CHECK_THROWS_WITH(capture->load(6, 1), Contains("no frame 6"));
}

TEST_CASE("what is wrong with an ActorsHQ capture is said with file, line, column and value") {
  SmallActorsHq small;
  SECTION("a missing calibration") {
    fs::remove(small.scale / "calibration.csv");
    CHECK_THROWS_WITH(small.open(),
                      Contains("holds no known capture") && Contains("actorshq: calibration.csv and rgbs/"));
    CaptureOptions options;
    options.format = "actorshq";
    CHECK_THROWS_WITH(small.open(options), Contains("no calibration.csv with rgbs/ beside it"));
  }
  SECTION("several captures") {
    fs::copy(small.scale, small.scale.parent_path() / "2x", fs::copy_options::recursive);
    CHECK_THROWS_WITH(small.open(), Contains("holds several captures; name one of ") && Contains("Sequence1/2x"));
  }
  SECTION("a missing column") {
    small.change_calibration("name,w,h,rx", "name,w,h,rq");
    CHECK_THROWS_WITH(small.open(), Contains("calibration.csv: has no column 'rx' in its first line"));
  }
  SECTION("a cut line") {
    small.change_calibration("Cam002,21,13,", "Cam002,21,");
    CHECK_THROWS_WITH(small.open(), Contains("calibration.csv: line 3: has 12 fields, but the head has 13 columns"));
  }
  SECTION("no number") {
    small.change_calibration("Cam002,21,", "Cam002,wide,");
    CHECK_THROWS_WITH(small.open(), Contains("calibration.csv: line 3: w is 'wide'; expected a number"));
  }
  SECTION("no size") {
    small.change_calibration("Cam002,21,", "Cam002,-21,");
    CHECK_THROWS_WITH(small.open(), Contains("line 3: w is '-21'; expected pixels"));
  }
  SECTION("focal lengths in pixels") {
    small.change_calibration(fmt::format("{}", 31.0 / 21), "1500");
    CHECK_THROWS_WITH(small.open(), Contains("line 3: fx is '1500'; intrinsics are parts of the picture's size") &&
                                        Contains("divide pixels by w and h"));
  }
  SECTION("a name twice, or none") {
    const std::string name = GENERATE("Cam001", "", "../Cam001");
    small.change_calibration("Cam002", name);
    CHECK_THROWS_WITH(small.open(), Contains("line 3: name is '" + name + "'; expected the name of a folder of rgbs/"));
  }
  SECTION("no camera") {
    write_text_file(small.scale / "calibration.csv", "name,w,h,rx,ry,rz,tx,ty,tz,fx,fy,px,py\n\n");
    CHECK_THROWS_WITH(small.open(), Contains("calibration.csv: names no camera"));
  }
  SECTION("no parameters") {
    fs::remove(small.scale.parent_path() / "smpl_params.npz");
    CHECK_THROWS_WITH(small.open(), Contains("1x/smpl_params.npz: no such file") && Contains("fit SMPL-X"));
  }
  SECTION("parameters that are not finite") {
    std::vector<float> values(small_frames * 63, 0.0f);
    values[63 * 4] = std::numeric_limits<float>::infinity();
    const NpyArray array = NpyArray::from({small_frames, 63}, values);
    replace_array(small.scale.parent_path() / "smpl_params.npz", "body_pose", &array);
    CHECK_THROWS_WITH(small.open(), Contains("smpl_params.npz: 'body_pose' holds inf in row 4"));
  }
  SECTION("parameters without hands") {
    replace_array(small.scale.parent_path() / "smpl_params.npz", "left_hand_pose", nullptr);
    CHECK_THROWS_WITH(small.open(), Contains("smpl_params.npz: ") && Contains("left_hand_pose"));
  }
  SECTION("no picture and no mask at all") {
    fs::remove_all(small.scale / "masks");
    CHECK_THROWS_WITH(small.open(), Contains("no camera has a mask; the first would be ") &&
                                        Contains("masks/Cam001/Cam001_mask000000"));
    fs::remove_all(small.scale / "rgbs/Cam001");
    fs::remove_all(small.scale / "rgbs/Cam002");
    CHECK_THROWS_WITH(small.open(), Contains("no camera has a picture"));
  }
  SECTION("a picture of another size") {
    write_image(small.scale / "rgbs/Cam001/Cam001_rgb000002.png", Image8::black(20, 13, 3));
    CHECK_THROWS_WITH(small.open()->load(2, 0),
                      Contains("Cam001_rgb000002.png: is 20x13, but the calibration of Cam001 says 21x13"));
  }
  SECTION("a picture that is none, and an empty mask") {
    write_text_file(small.scale / "rgbs/Cam001/Cam001_rgb000002.png", "no picture");
    CHECK_THROWS_WITH(small.open()->load(2, 0), Contains("Cam001_rgb000002.png: is no picture"));
    write_image(small.scale / "masks/Cam001/Cam001_mask000003.png", Image8::black(21, 13, 1));
    CHECK_THROWS_WITH(small.open()->load(3, 0), Contains("Cam001_mask000003.png: frame 3 of Cam001 has an empty mask"));
  }
}

TEST_CASE("another file's body parameters stand in for those that a recording came without") {
  SmallActorsHq small;
  const auto own = small.open();
  CaptureOptions options;
  options.poses = small.scale / "fit of a project.npz";
  fs::rename(small.scale.parent_path() / "smpl_params.npz", options.poses);
  const auto fitted = open_uncached_capture(small.scale, options);
  REQUIRE(fitted->frame_count() == own->frame_count());
  CHECK(fitted->has_poses());
  CHECK(fitted->pose(3).axis_angles == own->pose(3).axis_angles);
  CHECK(fitted->betas() == own->betas());
  CHECK(fitted->load(2, 1).image.pixels == own->load(2, 1).image.pixels);
  options.poses = small.scale / "no_such_fit.npz";
  CHECK_THROWS_WITH(open_uncached_capture(small.scale, options), Contains("no_such_fit.npz: no such file"));
}

TEST_CASE("an incomplete capture is opened to be looked at, without what it lacks") {
  SmallActorsHq small;
  fs::remove_all(small.scale / "masks");
  fs::remove(small.scale.parent_path() / "smpl_params.npz");
  CaptureOptions options;
  options.incomplete = true;
  const auto capture = small.open(options);
  CHECK(capture->frame_count() == small_frames);
  CHECK_FALSE(capture->has_masks());
  CHECK_FALSE(capture->has_poses());
  CHECK(capture->load(2, 1).image.pixels == small_image(2, 1).pixels);
}

TEST_CASE("damaged calibrations give an Error, never a crash") {
  SmallActorsHq small;
  const auto good = read_file_bytes(small.scale / "calibration.csv");
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    auto bad = good;
    if (round % 4 == 0)
      bad.resize(random() % bad.size());
    else
      bad[random() % bad.size()] ^= std::byte(1 << random() % 7);
    write_file_atomically(small.scale / "calibration.csv", bad);
    try {
      small.open();
    } catch (const Error& error) {
      CHECK_THAT(error.what(), Contains("Sequence1/1x"));
    }
  }
}

TEST_CASE("capture A in the ActorsHQ layout shows what the DREAMS layout shows") {
  const std::string folder = data_path("data/capture/A_actorshq"), dreams_folder = data_path("data/capture/A/P1C1");
  if (folder.empty() || dreams_folder.empty()) return;
  int warnings = 0;
  CaptureOptions options;
  options.warn = [&](const std::string&) { ++warnings; };
  const auto capture = open_uncached_capture(folder, options), dreams = open_uncached_capture(dreams_folder, options);
  CHECK(warnings == 0);
  CHECK(capture->frame_count() == 40);
  REQUIRE(capture->camera_names().size() == 13);
  CHECK(capture->camera_names()[2] == "Cam003");
  for (int camera = 0; camera < 13; ++camera) {
    const Camera a = capture->camera(camera), b = dreams->camera(camera);
    CHECK((a.rotation - b.rotation).norm() < 1e-6);
    CHECK((a.translation - b.translation).norm() < 1e-6);
    CHECK(std::abs(a.fx - b.fx) + std::abs(a.fy - b.fy) + std::abs(a.cx - b.cx) + std::abs(a.cy - b.cy) < 1e-3);
  }
  for (const int frame : {0, 17}) {
    CHECK((capture->pose(frame).axis_angles[5] - dreams->pose(2 * frame).axis_angles[5]).norm() < 1e-6);
    const Sample a = capture->load(frame, 4), b = dreams->load(2 * frame, 4);
    double difference = 0, people = 0;
    int masks_differ = 0;
    for (size_t i = 0; i < a.mask.pixels.size(); ++i) {
      masks_differ += (a.mask.pixels[i] >= 128) != (b.mask.pixels[i] >= 128);
      if (b.mask.pixels[i] < 255) continue;
      ++people;
      difference += std::abs(a.image.pixels[3 * i + 1] - b.image.pixels[3 * i + 1]);
    }
    CHECK(masks_differ < 0.01 * people);
    CHECK(difference / people < 4);
  }
}
