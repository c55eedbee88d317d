#include "model/faces/head_pose.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/error.h"
#include "tests/support/catch.h"
#include "tests/support/training_scene.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

constexpr double degree = std::numbers::pi / 180;
const std::filesystem::path file = std::filesystem::path(DEGAS_TEST_VECTORS) / "io/head_pose.onnx";

double angle_of(const std::vector<float>& output) {
  return angle_off_front(output, "pose.onnx");
}

}  // namespace

TEST_CASE("angles and rotations tell alike how far a head is turned away; rolling turns nobody away") {
  CHECK(angle_of({0, 0, 50}) == Approx(0).margin(1e-6));
  CHECK(angle_of({30, 0, 0}) == Approx(30 * degree));
  CHECK(angle_of({0, -20, 10}) == Approx(20 * degree));
  CHECK(angle_of({120, 0, 0}) == Approx(120 * degree));
  const double yaw = 35, pitch = -15, roll = 70;
  const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(roll * degree, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(pitch * degree, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(yaw * degree, Eigen::Vector3d::UnitY()))
                                       .toRotationMatrix();
  const double expected = angle_of({35, -15, 70});
  CHECK(expected == Approx(std::acos(std::cos(yaw * degree) * std::cos(pitch * degree))));
  std::vector<float> nine, twelve;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      nine.push_back(static_cast<float>(rotation(row, column)));
      twelve.push_back(
          static_cast<float>(5e-4 * rotation(row, column)));  // as 3D face models have it, with their scale
    }
    twelve.push_back(static_cast<float>(60 + row));
  }
  CHECK(angle_of(nine) == Approx(expected).margin(1e-5));
  CHECK(angle_of(twelve) == Approx(expected).margin(1e-5));
  CHECK_THROWS_WITH(angle_of({1, 2, 3, 4}), Contains("pose.onnx: a head pose of 4 numbers") && Contains("output=NAME"));
  CHECK_THROWS_WITH(angle_of(std::vector<float>(9, 0)), Contains("all zeros"));
  CHECK_THROWS_WITH(angle_of({0, std::numeric_limits<float>::quiet_NaN(), 0}), Contains("not finite"));
}

TEST_CASE("faces are ranked by the network's angle, and those turned away or without a picture are left out") {
  // Cameras 0 .. 4 see red of 0.8, 0.6, 0.4, 0.2 and 0: yaws of 72, 54, 36, 18 and 0 degrees.
  ChangedCapture capture;
  capture.change_sample = [](Sample& sample) {
    for (size_t i = 0; i < sample.image.pixels.size(); i += 3) {
      sample.image.pixels[i] = static_cast<uint8_t>(51 * (4 - sample.camera));
      sample.image.pixels[i + 1] = sample.image.pixels[i + 2] = 0;
    }
  };
  capture.lacks_image = [](int, int camera) { return camera == 3; };
  std::vector<FaceBox> faces;
  for (int camera = 0; camera < 5; ++camera) faces.push_back({2, camera, {20, 20, 16, 12}, 0});
  HeadPoseNetwork network(file, {16, {0, 0, 0}, {1 / 255.0, 1 / 255.0, 1 / 255.0}}, "");
  const auto ranked = ranked_by_head_pose(capture, faces, network, 4, 60 * degree, [](int, int) { return true; });
  REQUIRE(ranked);
  const FaceCrops crops(*ranked, {});
  const std::vector<FaceBox>& of_frame = crops.of_frame(2);
  REQUIRE(of_frame.size() == 3);
  CHECK(of_frame[0].camera == 4);
  CHECK(of_frame[1].camera == 2);
  CHECK(of_frame[2].camera == 1);
  CHECK(of_frame[0].rank == Approx(0).margin(1e-3));
  CHECK(of_frame[1].rank == Approx(36 * degree).epsilon(1e-3));
  CHECK_FALSE(ranked_by_head_pose(capture, faces, network, 4, 1, [](int done, int) { return done < 2; }).has_value());
}
