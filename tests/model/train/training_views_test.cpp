#include "model/train/training_views.h"

#include <algorithm>
#include <set>

#include "host/error.h"
#include "tests/model/train/fake_capture.h"
#include "tests/support/catch.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

TEST_CASE("held-out cameras and those beyond data.cameras are left out") {
  const FakeCapture capture;
  DataConfig data;
  CHECK(allowed_cameras(capture, data) == std::vector<int>{0, 1, 2, 3});
  data.hold_out = {"cam02"};
  CHECK(allowed_cameras(capture, data) == std::vector<int>{0, 1, 3});
  data.cameras = {"cam03", "cam02"};
  CHECK(allowed_cameras(capture, data) == std::vector<int>{3});
  const TrainingViews views(capture, data);
  REQUIRE(views.training.size() == 4);
  for (const LoadRequest& frame : views.training) CHECK(frame.cameras == std::vector<int>{3});
  CHECK(views.validation.empty());
  CHECK(views.window_width == 0);
}

TEST_CASE("what a config names and a capture lacks is said") {
  const FakeCapture capture;
  DataConfig data;
  SECTION("a camera") {
    data.hold_out = {"cam7"};
    CHECK_THROWS_WITH(allowed_cameras(capture, data),
                      "data.hold_out: no camera 'cam7'; cameras here: cam00, cam01, cam02, cam03");
  }
  SECTION("all cameras held out") {
    data.hold_out = capture.names;
    CHECK_THROWS_WITH(TrainingViews(capture, data), Contains("data.hold_out") && Contains("hold out fewer"));
  }
  SECTION("a camera named twice") {
    data.cameras = {"cam01", "cam01"};
    CHECK_THROWS_WITH(TrainingViews(capture, data), Contains("data.cameras: 'cam01' selects some twice"));
  }
  SECTION("a frame") {
    data.frames = {"1", "4"};
    CHECK_THROWS_WITH(TrainingViews(capture, data),
                      Contains("data.frames: '4' lies outside the capture; give frames of 0 .. 3"));
  }
  SECTION("a frame named twice") {
    data.frames = {"1", "3", "1"};
    CHECK_THROWS_WITH(TrainingViews(capture, data), Contains("data.frames: '1' selects some twice"));
  }
  SECTION("pictures") {
    FakeCapture without;
    without.has_picture = [](int, int) { return false; };
    CHECK_THROWS_WITH(TrainingViews(without, data), Contains("no picture to train on"));
  }
}

TEST_CASE("ranges select cameras and frames, and a run keeps the names") {
  const FakeCapture capture;
  Config config;
  config.data.cameras = {"cam01:"};
  config.data.hold_out = {"cam02:cam03"};
  config.data.frames = {"0:4:3"};
  const TrainingViews views(capture, config.data);
  REQUIRE(views.training.size() == 2);
  CHECK(views.training[1].frame == 3);
  CHECK(views.training[1].cameras == std::vector<int>{1, 3});
  const DataConfig named = with_camera_names(config, capture).data;
  CHECK(named.cameras == std::vector<std::string>{"cam01", "cam02", "cam03"});
  CHECK(named.hold_out == std::vector<std::string>{"cam02"});
  CHECK(named.validation.empty());
}

TEST_CASE("frames and cameras without a picture are passed over") {
  FakeCapture capture;
  capture.has_picture = [](int frame, int camera) { return frame != 2 && (frame != 1 || camera == 3); };
  const TrainingViews views(capture, {});
  REQUIRE(views.training.size() == 3);
  CHECK(views.training[0].cameras == std::vector<int>{0, 1, 2, 3});
  CHECK(views.training[1].frame == 1);
  CHECK(views.training[1].cameras == std::vector<int>{3});
  CHECK(views.training[2].frame == 3);
}

TEST_CASE("validation views are never training views") {
  FakeCapture capture;
  capture.frames = 64;
  DataConfig data;
  SECTION("of named cameras: every picture") {
    data.validation = {"cam01"};
    const TrainingViews views(capture, data);
    CHECK(views.validation.size() == 64);
    for (const FrameCamera& view : views.validation) CHECK(view.camera == 1);
    for (const LoadRequest& frame : views.training) CHECK(frame.cameras == std::vector<int>{0, 2, 3});
  }
  SECTION("of none: one of every 16th frame, another camera each time") {
    const TrainingViews views(capture, data);
    REQUIRE(views.validation.size() == 4);
    std::set<int> cameras;
    for (const FrameCamera& view : views.validation) {
      cameras.insert(view.camera);
      const LoadRequest& frame = views.training[static_cast<size_t>(view.frame)];
      CHECK(frame.frame == view.frame);
      CHECK(frame.cameras.size() == 3);
      CHECK(std::count(frame.cameras.begin(), frame.cameras.end(), view.camera) == 0);
    }
    CHECK(cameras.size() == 4);
  }
}

TEST_CASE("the window holds the largest person with its margin, in steps of 16 pixels") {
  FakeCapture capture;
  DataConfig data;
  data.crop_to_person = true;
  data.crop_margin = 5;
  data.frames = {"0", "3"};
  const TrainingViews views(capture, data);
  CHECK(views.window_width == 48);   // 23 + 2 * 5 = 33
  CHECK(views.window_height == 64);  // 53 + 2 * 5 = 63
}

TEST_CASE("the box of a mask is its smallest rectangle; an empty mask has the whole picture") {
  Image8 mask = Image8::black(9, 7, 1);
  Rectangle box = mask_box(mask);
  CHECK((box.left == 0 && box.top == 0 && box.width == 9 && box.height == 7));
  *mask.at(8, 2) = 16;
  *mask.at(3, 6) = 255;
  *mask.at(0, 0) = 15;  // noise of a video codec
  box = mask_box(mask);
  CHECK((box.left == 3 && box.top == 2 && box.width == 6 && box.height == 5));
}

TEST_CASE("a window lies about its box and within the picture") {
  const auto corners = [](const Rectangle& r) { return std::vector<int>{r.left, r.top, r.width, r.height}; };
  CHECK(corners(window_around({40, 50, 10, 20}, 32, 48, 100, 120)) == std::vector<int>{29, 36, 32, 48});
  CHECK(corners(window_around({0, 100, 10, 20}, 32, 48, 100, 120)) == std::vector<int>{0, 72, 32, 48});
  CHECK(corners(window_around({90, 0, 10, 20}, 32, 48, 100, 120)) == std::vector<int>{68, 0, 32, 48});
  CHECK(corners(window_around({40, 50, 10, 20}, 128, 48, 100, 120)) == std::vector<int>{0, 36, 100, 48});
}
