#include "model/train/face_codes.h"

#include <cmath>

#include "host/error.h"
#include "tests/model/train/fake_capture.h"
#include "tests/support/catch.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

/// Cameras 0 .. 3 see the face at angles 0.4, 0.1, 0.3, 0.2; a camera is told from the others by its fx.
FakeCapture ring() {
  FakeCapture capture;
  capture.view = [](int camera) {
    Camera view;
    view.fx = camera;
    return view;
  };
  capture.code = [](int frame, int camera) {
    return std::vector<float>{static_cast<float>(camera), static_cast<float>(frame)};
  };
  return capture;
}

double angle(int, const Camera& camera) {
  constexpr double angles[] = {0.4, 0.1, 0.3, 0.2};
  return angles[static_cast<int>(camera.fx)];
}

}  // namespace

TEST_CASE("the codes of the most frontal cameras serve, the most frontal first") {
  const FakeCapture capture = ring();
  CHECK(FaceCodes(capture, {0, 1, 2, 3}, {FaceSignal::Code, 3}, angle).cameras_of(0) == std::vector<int>{1, 3, 2});
  CHECK(FaceCodes(capture, {0, 2, 3}, {FaceSignal::Code, 2}, angle).cameras_of(0) ==
        std::vector<int>{3, 2});  // 1 is held out
  FaceCodes all(capture, {0, 1, 2, 3}, {FaceSignal::Code, 9}, angle);
  CHECK(all.cameras_of(2).size() == 4);
  CHECK(all.size() == 2);
}

TEST_CASE("a camera without a code gives its place to the next; without any the code is zero") {
  FakeCapture capture = ring();
  capture.code = [](int frame, int camera) {
    return frame == 1 || camera == 3 ? std::vector<float>{} : std::vector<float>{1, 2};
  };
  FaceCodes codes(capture, {0, 1, 2, 3}, {FaceSignal::Code, 2}, angle);
  CHECK(codes.cameras_of(0) == std::vector<int>{1, 2});
  CHECK(codes.cameras_of(1).empty());
  CHECK(codes.mean(1) == std::vector<float>{0, 0});
  Random random = Random::of_step(1, 2, 3);
  CHECK(codes.mixture(1, random) == std::vector<float>{0, 0});
}

TEST_CASE("evaluation takes the mean, training a convex mixture that varies with the step alone") {
  const FakeCapture capture = ring();
  FaceCodes codes(capture, {1, 2, 3}, {FaceSignal::Code, 3}, angle);
  CHECK(codes.mean(2) == std::vector<float>{2, 2});
  double lowest = 3, highest = 1;
  for (int64_t step = 0; step < 200; ++step) {
    Random random = Random::of_step(1, 3, step), again = Random::of_step(1, 3, step);
    const std::vector<float> mixture = codes.mixture(0, random);
    CHECK(mixture == codes.mixture(0, again));
    CHECK(mixture[0] >= 1);
    CHECK(mixture[0] <= 3);
    lowest = std::min<double>(lowest, mixture[0]);
    highest = std::max<double>(highest, mixture[0]);
  }
  CHECK(lowest < 1.3);
  CHECK(highest > 2.7);
}

TEST_CASE("a code that is not finite or has another length is an Error with frame and camera") {
  FakeCapture capture = ring();
  capture.code = [](int frame, int) { return frame == 0 ? std::vector<float>{1, NAN} : std::vector<float>{1, 2, 3}; };
  FaceCodes codes(capture, {2}, {FaceSignal::Code, 4}, angle);
  CHECK_THROWS_WITH(codes.mean(0), Contains("frame 0, camera cam02: not finite"));
  CHECK_THROWS_WITH(codes.mean(0), Contains("not finite"));  // not kept as a frame without codes
  CHECK_THROWS_WITH(codes.mean(1), Contains("frame 1, camera cam02: 3 values where others have 2"));
}

TEST_CASE("an expression signal needs no camera's code") {
  FakeCapture capture = ring();
  capture.jaw = {0.1, -0.2, 0.3};
  capture.expression = {4, 5};
  const FaceConfig config{FaceSignal::Expression, 4};
  CHECK(face_code_size(capture, FaceSignal::Code) == 2);
  CHECK(face_code_size(capture, FaceSignal::Expression) == 5);
  FaceCodes codes(capture, {}, config, angle);
  Random random = Random::of_step(1, 2, 3);
  CHECK(codes.size() == 5);
  const std::vector<float> expected = {4, 5, 0.1F, -0.2F, 0.3F};
  CHECK(codes.mean(1) == expected);
  CHECK(codes.mixture(1, random) == expected);
}
