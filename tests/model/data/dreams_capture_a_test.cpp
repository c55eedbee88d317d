#include <Eigen/Geometry>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/npz.h"
#include "host/io/video.h"
#include "model/data/dreams_capture.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

/// World positions of the joints: plain forward kinematics.
std::vector<Eigen::Vector3d> joint_positions(const Pose& pose, const NpzFile& body) {
  const std::vector<double> rest = body.read("J", {55, 3}).doubles();
  const std::vector<int64_t> tree = body.read("kintree_table", {2, 55}).integers();
  std::vector<Eigen::Isometry3d> world(55);
  std::vector<Eigen::Vector3d> positions;
  for (size_t joint = 0; joint < 55; ++joint) {
    const Eigen::Vector3d place(rest[3 * joint], rest[3 * joint + 1], rest[3 * joint + 2]);
    const double angle = pose.axis_angles[joint].norm();
    const Eigen::Vector3d axis =
        angle > 0 ? Eigen::Vector3d(pose.axis_angles[joint] / angle) : Eigen::Vector3d::UnitX();
    const auto parent = static_cast<size_t>(tree[joint]);
    Eigen::Vector3d offset = place;
    if (joint > 0) offset -= Eigen::Vector3d(rest[3 * parent], rest[3 * parent + 1], rest[3 * parent + 2]);
    const Eigen::Isometry3d local = Eigen::Translation3d(offset) * Eigen::AngleAxisd(angle, axis);
    world[joint] = joint == 0 ? local : world[parent] * local;
    positions.push_back(world[joint].translation() + pose.translation);
  }
  return positions;
}

}  // namespace

TEST_CASE("capture A: joints fall into the masks of every camera") {
  const std::string folder = data_path("data/capture/A/P1C1"), body_path = data_path("data/bodies/male.npz");
  if (folder.empty() || body_path.empty()) return;
  const DreamsCapture capture(folder, {});
  const NpzFile body(body_path);
  CHECK(capture.frame_count() == 80);
  CHECK(capture.face_code_size() == 512);
  CHECK(capture.flat_hand_mean());
  CHECK((capture.camera(2).center() - Eigen::Vector3d(0.159, 1.3, 3.238)).norm() < 1e-3);
  int inside = 0, total = 0;
  for (const int frame : {0, 37, 79}) {
    const std::vector<Eigen::Vector3d> joints = joint_positions(capture.pose(frame), body);
    for (int camera = 0; camera < 13; ++camera) {
      const Sample sample = capture.load(frame, camera);
      for (const Eigen::Vector3d& joint : joints) {
        const Eigen::Vector3d pixel = sample.view.project(joint);
        const int x = static_cast<int>(std::floor(pixel.x())), y = static_cast<int>(std::floor(pixel.y()));
        ++total;
        inside += pixel.z() > 0 && x >= 0 && y >= 0 && x < sample.mask.width &&
                  y<sample.mask.height&& * sample.mask.at(x, y)> 127;
      }
    }
  }
  CAPTURE(inside, total);
  CHECK(inside > 0.97 * total);
}

TEST_CASE("capture A: put back over white, pictures are the video's") {
  const std::string folder = data_path("data/capture/A/P1C1");
  if (folder.empty()) return;
  const DreamsCapture capture(folder, {});
  const Sample sample = capture.load(40, 2);
  VideoReader reader(folder + "/videos/cam02.mp4");
  reader.seek(40);
  Image8 raw;
  REQUIRE(reader.read(raw));
  double error = 0;
  int64_t stray = 0;
  for (int y = 0; y < 640; ++y) {
    for (int x = 0; x < 480; ++x) {
      const int alpha = *sample.mask.at(x, y);
      stray += alpha > 0 && alpha < 8;
      for (int c = 0; c < 3; ++c) {
        const double difference = sample.image.at(x, y)[c] + 255 - alpha - raw.at(x, y)[c];
        error += difference * difference / (640.0 * 480 * 3);
      }
    }
  }
  const double psnr = 10 * std::log10(255 * 255 / error);
  std::printf("recomposed over white: %.1f dB; %ld pixels with alpha 1..7\n", psnr, static_cast<long>(stray));
  CHECK(psnr > 45);
}

TEST_CASE("capture A: frames sought are the frames read in order; P1C2 lacks cameras without a warning") {
  const std::string folder = data_path("data/capture/A/P1C2");
  if (folder.empty()) return;
  int warnings = 0;
  CaptureOptions options;
  options.warn = [&](const std::string&) { ++warnings; };
  const DreamsCapture capture(folder, options);
  CHECK(warnings == 0);
  CHECK(capture.frame_count() == 32);
  CHECK(capture.has_image(0, 5));
  CHECK_FALSE(capture.has_image(0, 6));
  std::vector<std::vector<uint8_t>> in_order;
  for (int frame = 0; frame < 32; ++frame) in_order.push_back(capture.load(frame, 9).image.pixels);
  for (const int frame : {31, 3, 20, 19, 0, 25}) {
    const bool same = capture.load(frame, 9).image.pixels == in_order[static_cast<size_t>(frame)];
    CHECK(same);
  }
}

TEST_CASE("capture A: a video with flipped bits or without its end gives an Error or pictures, never a crash") {
  const std::string folder = data_path("data/capture/A/P1C2");
  if (folder.empty()) return;
  const TemporaryFolder copy;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename() != "videos")
      fs::copy(entry.path(), copy / entry.path().filename().string(), fs::copy_options::recursive);
  }
  fs::permissions(copy / "capture.json", fs::perms::owner_all);
  nlohmann::json description = nlohmann::json::parse(std::ifstream(copy / "capture.json"));
  description["cameras_present"] = {0};
  write_text(copy / "capture.json", description.dump());
  const auto good = read_file_bytes(folder + "/videos/cam00.mp4");
  std::mt19937 random(4);
  for (int round = 0; round < 6; ++round) {
    auto bad = good;
    if (round % 3 == 0)
      bad.resize(bad.size() / 2);
    else
      for (int flips = 0; flips < 200; ++flips) bad[random() % bad.size()] ^= std::byte(1 << random() % 8);
    write_file_atomically(copy / "videos/cam00.mp4", bad);
    try {
      const DreamsCapture capture(copy.path(), {});
      for (int frame = 0; frame < 32; frame += 7) capture.load(frame, 0);
      CHECK(round % 3 != 0);
    } catch (const Error& error) {
      CHECK_THAT(error.what(), Contains("cam00.mp4"));
    }
  }
}
