#include "model/data/packed_capture.h"

#include <cstring>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "model/body/body_model.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"
#include "tests/support/training_scene.h"
#include "tests/support/training_steps.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

/// The scene packed once a program.
const fs::path& scene_pack() {
  static const TemporaryFolder folder;
  static const fs::path path = [] {
    CaptureOptions options;
    const auto capture = open_uncached_capture(training_scene() / "P1C1", options);
    write_pack(folder / "P1C1.pack", *capture, {});
    return folder / "P1C1.pack";
  }();
  return path;
}

void write_bytes(const fs::path& path, const std::vector<std::byte>& bytes) {
  write_file_atomically(path, bytes);
}

/// Reads all that a pack has; true when it is what the whole file gave, false for an Error that names the file.
bool reads_intact(const fs::path& path, const Capture& whole) {
  try {
    const auto capture = open_capture(path);
    bool same = capture->identity() == whole.identity() && capture->frame_count() == whole.frame_count();
    for (int frame = 0; same && frame < whole.frame_count(); ++frame) {
      for (int camera = 0; camera < static_cast<int>(whole.camera_names().size()); ++camera) {
        const Sample a = capture->load(frame, camera), b = whole.load(frame, camera);
        same = same && a.image.pixels == b.image.pixels && a.mask.pixels == b.mask.pixels;
      }
    }
    return same;
  } catch (const Error& failure) {
    REQUIRE_THAT(failure.what(), Contains(path.string()));
    REQUIRE(std::strchr(failure.what(), '\n') == nullptr);
    return false;
  }
}

void check_equal(const Capture& packed, const Capture& source) {
  CHECK(packed.identity() == source.identity());
  CHECK(packed.picture_identity() == source.picture_identity());
  CHECK(packed.camera_names() == source.camera_names());
  CHECK(packed.betas() == source.betas());
  CHECK(packed.flat_hand_mean() == source.flat_hand_mean());
  CHECK(packed.face_code_size() == source.face_code_size());
  REQUIRE(packed.frame_count() == source.frame_count());
  for (int frame = 0; frame < source.frame_count(); ++frame) {
    const Pose a = packed.pose(frame), b = source.pose(frame);
    REQUIRE(a.axis_angles == b.axis_angles);
    REQUIRE(a.translation == b.translation);
    REQUIRE(a.expression == b.expression);
    REQUIRE(a.hand_coefficients == b.hand_coefficients);
    REQUIRE(packed.frame_number(frame) == source.frame_number(frame));
    for (int camera = 0; camera < static_cast<int>(source.camera_names().size()); ++camera) {
      CAPTURE(frame, camera);
      const Camera seen = packed.camera(camera), there = source.camera(camera);
      REQUIRE((seen.width == there.width && seen.height == there.height));
      REQUIRE((seen.fx == there.fx && seen.fy == there.fy && seen.cx == there.cx && seen.cy == there.cy));
      REQUIRE((seen.rotation == there.rotation && seen.translation == there.translation));
      REQUIRE(packed.has_face_code(frame, camera) == source.has_face_code(frame, camera));
      REQUIRE(packed.face_code(frame, camera) == source.face_code(frame, camera));
      REQUIRE(packed.has_image(frame, camera) == source.has_image(frame, camera));
      if (!source.has_image(frame, camera)) continue;
      const Sample sample = packed.load(frame, camera), original = source.load(frame, camera);
      REQUIRE(sample.image.pixels == original.image.pixels);
      REQUIRE(sample.mask.pixels == original.mask.pixels);
    }
  }
}

}  // namespace

TEST_CASE("a pack gives what the capture gave, at any scale and number of threads") {
  const TemporaryFolder folder;
  CaptureOptions opening;
  opening.image_scale = GENERATE(1.0, 0.5);
  opening.cache = folder / "cache";
  const auto source = open_uncached_capture(training_scene() / "P1C1", opening);
  PackOptions options;
  options.image_scale = opening.image_scale;
  std::vector<int64_t> frames;
  options.progress = [&](int64_t done, int64_t) { frames.push_back(done); };
  const PackSummary summary = write_pack(folder / "a.pack", *source, options);
  CHECK(frames == std::vector<int64_t>{1, 2, 3, 4, 5, 6});
  CHECK(summary.pictures == 30);
  CHECK(summary.bytes == fs::file_size(folder / "a.pack"));
  options.threads = 3;
  write_pack(folder / "b.pack", *source, options);
  CHECK(read_file_bytes(folder / "a.pack") == read_file_bytes(folder / "b.pack"));

  const auto packed = open_capture(folder / "a.pack", opening);
  check_equal(*packed, *open_capture(training_scene() / "P1C1", opening));
  CHECK_THROWS_WITH(packed->load(99, 0), Contains("a.pack: has no picture of frame 99"));
  opening.image_scale = 0.25;
  CHECK_THROWS_WITH(open_capture(folder / "a.pack", opening), Contains("but data.image_scale is 0.25"));
  opening.codes = folder.path();
  CHECK_THROWS_WITH(open_capture(folder / "a.pack", opening), Contains("a pack has its face codes within"));
}

TEST_CASE("a pack keeps holes, and warns of pictures that cannot be used") {
  const TemporaryFolder folder;
  ChangedCapture source;
  source.lacks_image = [](int frame, int camera) { return frame == 2 && camera == 1; };
  source.replace_code = [](int frame, int) -> std::optional<std::vector<float>> {
    return frame == 1 ? std::optional(std::vector<float>{1, -2, 3}) : std::nullopt;
  };
  source.code_size = 3;
  source.change_sample = [](Sample& sample) {
    if (sample.camera == 3 && sample.frame > 3) throw Error("video: does not decode");
  };
  PackOptions options;
  std::vector<std::string> warnings;
  options.warn = [&](const std::string& text) { warnings.push_back(text); };
  CHECK(write_pack(folder / "a.pack", source, options).pictures == 27);
  CHECK(warnings == std::vector<std::string>{"video: does not decode (skipped: 2 of 6 frames of this camera)"});
  const PackedCapture packed(folder / "a.pack", 1);
  CHECK(!packed.has_image(2, 1));
  CHECK(!packed.has_image(4, 3));
  CHECK(packed.has_image(3, 3));
  CHECK(packed.face_code(1, 4) == std::optional(std::vector<float>{1, -2, 3}));
  CHECK(packed.face_code(0, 4) == std::nullopt);
}

TEST_CASE("training from a pack gives the bits of training from the capture") {
  const TemporaryFolder folder;
  Config config = tiny_config();
  config.train.iterations = 4;
  config.data.crop_to_person = true;
  config.data.hold_out = {"cam02"};
  train_run(folder / "from_capture", config, *open_scene());
  train_run(folder / "from_pack", config, *open_capture(scene_pack()));
  CHECK(read_file_bytes(folder / "from_capture/checkpoint.bin") ==
        read_file_bytes(folder / "from_pack/checkpoint.bin"));
}

TEST_CASE("fingers by principal components train like their angles, from the capture and from a pack") {
  // The components of the scene's body are the angles one by one.
  const TemporaryFolder folder;
  const auto straighten = [](int, Pose& pose) {
    for (size_t joint = LeftHandJoint; joint < 55; ++joint) pose.axis_angles[joint].setZero();
  };
  ChangedCapture straight, by_components, by_angles;
  straight.change_pose = straighten;
  by_components.change_pose = [&](int frame, Pose& pose) {
    straighten(frame, pose);
    pose.hand_coefficients = {random_values(6, 1 + frame), random_values(6, 20 + frame)};
  };
  by_angles.change_pose = [&](int frame, Pose& pose) {
    straighten(frame, pose);
    for (int i = 0; i < 6; ++i) {
      pose.axis_angles[LeftHandJoint + i / 3][i % 3] = random_values(6, 1 + frame)[i];
      pose.axis_angles[RightHandJoint + i / 3][i % 3] = random_values(6, 20 + frame)[i];
    }
  };
  write_pack(folder / "a.pack", by_components, {});
  const auto pack = open_capture(folder / "a.pack");
  check_equal(*pack, by_components);

  Config config = tiny_config();
  config.train.iterations = 2;
  const auto trained = [&](const char* name, const Capture& capture) {
    train_run(folder / name, config, capture);
    return read_file_bytes(folder / name / "checkpoint.bin");
  };
  const std::vector<std::byte> expected = trained("angles", by_angles);
  CHECK(trained("components", by_components) == expected);
  CHECK(trained("pack", *pack) == expected);
  CHECK(trained("straight", straight) != expected);
}

TEST_CASE("damaged packs are refused in one line") {
  const TemporaryFolder folder;
  const std::vector<std::byte> whole = read_file_bytes(scene_pack());
  const fs::path path = folder / "damaged.pack";
  const auto refusal = [&] {
    try {
      open_capture(path);
    } catch (const Error& failure) {
      return std::string(failure.what());
    }
    return std::string("opened");
  };
  write_bytes(path, {});
  CHECK_THAT(refusal(), Contains("damaged.pack: is empty"));
  write_bytes(path, std::vector<std::byte>(1000));
  CHECK_THAT(refusal(), Contains("damaged.pack: is no pack; --data takes a capture's folder or a file"));
  // Cut anywhere, and lengthened.
  for (const size_t size : {size_t{1}, size_t{8}, size_t{100}, size_t{216}, whole.size() / 2, whole.size() - 1}) {
    write_bytes(path, {whole.begin(), whole.begin() + static_cast<ptrdiff_t>(size)});
    CAPTURE(size);
    CHECK_THAT(refusal(), Contains(size < 8 ? "is no pack" : size < 216 ? "is cut short" : "instead of"));
  }
  std::vector<std::byte> longer = whole;
  longer.push_back({});
  write_bytes(path, longer);
  CHECK_THAT(refusal(), Contains("lengthened"));
}

TEST_CASE("a flipped bit anywhere in a pack is noticed before its bytes are used") {
  const TemporaryFolder folder;
  const std::vector<std::byte> whole = read_file_bytes(scene_pack());
  const auto intact = open_capture(scene_pack());
  REQUIRE(reads_intact(scene_pack(), *intact));
  // Each bit of the header's ends, and places all over the file.
  std::vector<size_t> places = {0, 7, 8, 20, 40, 100, 215, 216, whole.size() - 1};
  for (const double part : random_values(40, 7, 0, 1)) {
    places.push_back(static_cast<size_t>(part * static_cast<double>(whole.size())));
  }
  for (size_t i = 0; i < places.size(); ++i) {
    std::vector<std::byte> damaged = whole;
    damaged[places[i]] ^= std::byte{1} << (i % 8);
    write_bytes(folder / "damaged.pack", damaged);
    CAPTURE(places[i]);
    REQUIRE(!reads_intact(folder / "damaged.pack", *intact));
  }
}

TEST_CASE("an interrupted or failing pack leaves what was there, and nothing else") {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.pack";
  write_bytes(path, std::vector<std::byte>(3));
  PackOptions options;
  int calls = 0;
  options.stop_requested = [&] { return ++calls > 2; };
  CHECK(write_pack(path, *open_scene(), options).interrupted);
  ChangedCapture empty;
  empty.lacks_image = [](int, int) { return true; };
  CHECK_THROWS_WITH(write_pack(path, empty, {}), Contains("no picture to pack"));
  ChangedCapture broken;
  broken.change_sample = [](Sample&) { throw std::bad_alloc(); };
  options.stop_requested = nullptr;
  options.threads = 2;
  CHECK_THROWS_AS(write_pack(path, broken, options), std::bad_alloc);
  CHECK(read_file_bytes(path).size() == 3);
  CHECK(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()) == 1);
}
