#include "model/data/avatarrex_capture.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "tests/model/data/small_picture_capture.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

constexpr int width = 160, height = 120;
constexpr double fx = 150, fy = 155, cx = 83.2, cy = 57.4;  // OpenCV's: pixel centres at whole numbers
const std::vector<double> distortion = {-0.25, 0.08, 0.002, -0.0015, 0.01};
constexpr double spread = 2.0;  // pixels, of a dot

/// A point in the picture with distortion, pixel centres at whole numbers: the model as OpenCV's manual gives it.
Eigen::Vector2d distorted_pixel(const Eigen::Vector3d& point) {
  const double x = point.x() / point.z(), y = point.y() / point.z(), r2 = x * x + y * y;
  const double radial = 1 + distortion[0] * r2 + distortion[1] * r2 * r2 + distortion[4] * r2 * r2 * r2;
  const double p1 = distortion[2], p2 = distortion[3];
  return {fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx,
          fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy};
}

const Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
const Eigen::Vector3d translation(0.1, -0.2, 3);

/// Points of the world, spread over the picture.
std::vector<Eigen::Vector3d> dots() {
  std::vector<Eigen::Vector3d> points;
  for (int column = -2; column <= 2; ++column) {
    for (int row = -1; row <= 1; ++row) {
      const double depth = 2.5 + 0.2 * column;
      const Eigen::Vector3d in_camera(0.2 * column * depth, 0.22 * row * depth, depth);
      points.push_back(rotation.transpose() * (in_camera - translation));
    }
  }
  return points;
}

/// What a camera with distortion sees of white dots at the points.
Image8 picture_of_dots() {
  Image8 image = Image8::black(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (const Eigen::Vector3d& dot : dots()) {
        const Eigen::Vector2d away = distorted_pixel(rotation * dot + translation) - Eigen::Vector2d(x, y);
        sum += std::exp(-0.5 * away.squaredNorm() / (spread * spread));
      }
      std::fill_n(image.at(x, y), 3, static_cast<uint8_t>(std::lround(std::min(255.0, 255 * sum))));
    }
  }
  return image;
}

json calibration_entry() {
  json r = json::array(), t = json::array();
  for (int k = 0; k < 9; ++k) r.push_back(rotation(k / 3, k % 3));
  for (int k = 0; k < 3; ++k) t.push_back(translation[k]);
  return {{"K", {fx, 0, cx, 0, fy, cy, 0, 0, 1}}, {"R", r}, {"T", t}, {"imgSize", {width, height}}};
}

Image8 full_mask() {
  Image8 mask = Image8::black(width, height, 1);
  std::fill(mask.pixels.begin(), mask.pixels.end(), uint8_t{200});
  std::fill_n(mask.at(0, 5), width, uint8_t{100});
  return mask;
}

/// Cameras 22010708 (with distortion) and 22010716 (without); AvatarReX's folders, or THuman4's.
struct SmallAvatarRex {
  TemporaryFolder folder;
  std::vector<std::string> warnings;
  json calibration;
  bool is_thuman;

  explicit SmallAvatarRex(bool thuman = false) : is_thuman(thuman) {
    calibration = {{"22010708", calibration_entry()}, {"22010716", calibration_entry()}};
    calibration["22010708"]["distCoeff"] = distortion;
    if (!thuman) calibration["22010716"]["distCoeff"] = std::vector<double>(5, 0.0);
    write_calibration();
    write_npz(folder / "smpl_params.npz", small_smpl_params());
    for (const std::string camera : {"22010708", "22010716"}) {
      for (int frame = 0; frame < small_frames; ++frame) {
        write_image(picture(camera, frame), picture_of_dots());
        write_image(mask(camera, frame), full_mask());
      }
    }
  }
  fs::path calibration_file() const { return folder / (is_thuman ? "calibration.json" : "calibration_full.json"); }
  void write_calibration() const { write_text_file(calibration_file(), calibration.dump()); }
  fs::path picture(const std::string& camera, int frame) const {
    return folder.path() / (is_thuman ? "images" : "") / camera / fmt::format("{:08}.png", frame);
  }
  fs::path mask(const std::string& camera, int frame) const {
    const std::string name = fmt::format("{:08}.png", frame);
    return is_thuman ? folder.path() / "masks" / camera / name : folder.path() / camera / "mask/pha" / name;
  }
  std::unique_ptr<Capture> open(CaptureOptions options = {}) {
    options.warn = [this](const std::string& text) { warnings.push_back(text); };
    return open_uncached_capture(folder.path(), options);
  }
};

/// Centre of the light around a pixel, pixel centres at +0.5.
Eigen::Vector2d centroid(const Image8& image, const Eigen::Vector2d& around) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double total = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector2d center(x + 0.5, y + 0.5);
      if ((center - around).norm() > 4.5 * spread) continue;
      const double value = image.at(x, y)[0];
      sum += value * center;
      total += value;
    }
  }
  return sum / total;
}

}  // namespace

TEST_CASE("pictures with a known distortion are read without it") {
  SmallAvatarRex small(GENERATE(false, true));
  const auto capture = small.open();
  CHECK(small.warnings.empty());
  CHECK(capture->camera_names() == std::vector<std::string>{"22010708", "22010716"});
  CHECK(capture->frame_count() == small_frames);
  const Sample straight = capture->load(1, 0), bent = capture->load(1, 1);
  CHECK((straight.view.rotation - rotation).norm() < 1e-12);
  CHECK(straight.view.cx == cx + 0.5);
  double moved = 0;
  int seen = 0;
  for (const Eigen::Vector3d& dot : dots()) {
    const Eigen::Vector2d pixel = straight.view.project(dot).head<2>();
    if (pixel.x() < 10 || pixel.y() < 10 || pixel.x() > width - 10 || pixel.y() > height - 10) continue;
    CAPTURE(pixel);
    CHECK((centroid(straight.image, pixel) - pixel).norm() < 0.1);
    const Eigen::Vector2d there = distorted_pixel(rotation * dot + translation) + Eigen::Vector2d(0.5, 0.5);
    CHECK((centroid(bent.image, there) - there).norm() < 0.1);  // the other camera says that it has none
    moved = std::max(moved, (there - pixel).norm());
    ++seen;
  }
  CHECK(seen >= 9);
  CHECK(moved > 2);  // or nothing was tested
}

TEST_CASE("cameras keep the order of the calibration, not that of their names") {
  SmallAvatarRex small;
  small.calibration["22010716"]["T"][0] = 0.7;
  write_text_file(small.calibration_file(),
                  fmt::format("{{\"22010716\": {}, \"22010708\": {}}}", small.calibration["22010716"].dump(),
                              small.calibration["22010708"].dump()));
  const auto capture = small.open();
  CHECK(capture->camera_names() == std::vector<std::string>{"22010716", "22010708"});
  CHECK(capture->camera(0).translation.x() == 0.7);
}

TEST_CASE("masks are cut at 128") {
  SmallAvatarRex small;
  const Sample sample = small.open()->load(0, 1);
  CHECK(*sample.mask.at(30, 4) == 255);
  CHECK(*sample.mask.at(30, 5) == 0);
  CHECK(sample.image.at(30, 5)[0] == 0);
}

TEST_CASE("views that the capture lists as missing are left out without a warning") {
  SmallAvatarRex small;
  fs::remove(small.picture("22010716", 3));
  write_text_file(small.folder / "missing_img_files.txt",
                  ".\\22010716\\00000003.jpg\r\n./22010708/00000001.jpg\n\nother/00000002.jpg\n");
  write_text_file(small.folder / "missing_msk_files.txt", "22010716/mask/pha/00000002.jpg\n");
  const auto capture = small.open();
  CHECK(small.warnings.empty());
  CHECK_FALSE(capture->has_image(3, 1));
  CHECK_FALSE(capture->has_image(2, 1));
  CHECK_FALSE(capture->has_image(1, 0));
  CHECK(capture->has_image(2, 0));
  CHECK(capture->has_image(1, 1));
  CHECK_THROWS_WITH(capture->load(1, 0), Contains("22010708 has no picture of frame 1: the capture lists it"));
}

TEST_CASE("what is wrong with an AvatarReX capture is said with file, camera, key and value") {
  SmallAvatarRex small;
  json& camera = small.calibration["22010716"];
  const auto refused = [&](const std::string& message) {
    small.write_calibration();
    CHECK_THROWS_WITH(small.open(), Contains("calibration_full.json: 22010716: " + message));
  };
  SECTION("a missing key") {
    const std::string key = GENERATE("K", "R", "T", "imgSize");
    camera.erase(key);
    refused("has no key '" + key + "'");
  }
  SECTION("no rotation") {
    camera["R"][0] = 7;
    refused("R: is no rotation: |R R^T - 1| = ");
  }
  SECTION("a mirror") {
    for (int k = 3; k < 6; ++k) camera["R"][k] = -camera["R"][k].get<double>();
    refused("R: is a mirror, no rotation");
  }
  SECTION("too few numbers") {
    camera["T"] = {1, 2};
    refused("T: has 2 numbers, expected 3");
  }
  SECTION("a list of coefficients that no lens model has") {
    camera["distCoeff"] = {1, 2, 3};
    refused("distCoeff: has 3 numbers, expected OpenCV's 4, 5, 8, 12 or 14");
  }
  SECTION("a focal length of nought") {
    camera["K"][0] = 0;
    refused("K: must have focal lengths above 0");
  }
  SECTION("a matrix in another order") {
    camera["K"] = {fx, 0, 0, 0, fy, 0, cx, cy, 1};
    refused("K: must be fx 0 cx, 0 fy cy, 0 0 1, row after row");
  }
  SECTION("a size that is none") {
    camera["imgSize"] = {width, 1.5};
    refused("imgSize[1]: is 1.5, expected a whole number");
  }
  SECTION("text") {
    camera["T"][1] = "x";
    refused("T[1]: is no number");
  }
  SECTION("no camera, and no object") {
    write_text_file(small.calibration_file(), "{}");
    CHECK_THROWS_WITH(small.open(), Contains("calibration_full.json: names no camera"));
    write_text_file(small.calibration_file(), "[1]");
    CHECK_THROWS_WITH(small.open(), Contains("calibration_full.json: is no object"));
  }
  SECTION("a list of missing files that is none") {
    write_text_file(small.folder / "missing_msk_files.txt", "22010708/00000001.jpg\n22010708/first.jpg\n");
    CHECK_THROWS_WITH(small.open(), Contains("missing_msk_files.txt: line 2 is '22010708/first.jpg', expected a path"));
  }
  SECTION("damaged JSON gives an Error, never a crash") {
    const auto good = read_file_bytes(small.calibration_file());
    std::mt19937 random(6);
    for (int round = 0; round < 200; ++round) {
      auto bad = good;
      if (round % 4 == 0)
        bad.resize(random() % bad.size());
      else
        bad[random() % bad.size()] ^= std::byte(1 << random() % 7);
      write_file_atomically(small.calibration_file(), bad);
      try {
        find_avatarrex_layout(small.folder.path());
      } catch (const Error& error) {
        CHECK_THAT(error.what(), Contains("calibration_full.json"));
      }
    }
  }
}

TEST_CASE("captures of different formats never share cached pictures") {
  const TemporaryFolder cache;
  SmallAvatarRex rex, thuman(true);
  const TemporaryFolder actors;
  write_small_actorshq(actors.path());
  CaptureOptions options;
  options.cache = cache.path();
  options.warn = [](const std::string&) {};
  size_t folders = 0;
  for (const fs::path& path : {rex.folder.path(), thuman.folder.path(), actors.path()}) {
    const auto capture = open_capture(path, options), raw = open_uncached_capture(path, options);
    for (int round = 0; round < 2; ++round) {  // decoded, then from the cache
      CHECK(capture->load(1, 1).image.pixels == raw->load(1, 1).image.pixels);
      CHECK(capture->load(1, 1).mask.pixels == raw->load(1, 1).mask.pixels);
    }
    ++folders;
    CHECK(static_cast<size_t>(std::distance(fs::directory_iterator(cache.path()), {})) == folders);
  }
}
