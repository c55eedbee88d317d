#include "model/data/loader.h"

#include <atomic>
#include <chrono>

#include "host/error.h"
#include "tests/support/test_devices.h"

using namespace degas;
using Catch::Contains;

namespace {

/// A capture whose pictures say which they are; frame 13 does not load.
class NumberedCapture : public Capture {
 public:
  std::string identity() const override { return "numbered"; }
  int frame_count() const override { return 1000; }
  const std::vector<std::string>& camera_names() const override { return names_; }
  Camera camera(int) const override { return {}; }
  bool has_image(int, int) const override { return true; }
  Sample load(int frame, int camera) const override {
    if (frame == 13) throw Error("frame 13 does not load");
    ++loads;
    std::this_thread::sleep_for(std::chrono::microseconds(frame * 7919 % 300));
    return {frame, camera, {}, Image8{1, 1, 3, {static_cast<uint8_t>(frame), static_cast<uint8_t>(camera), 0}}, {}};
  }
  Pose pose(int) const override { return {}; }
  std::vector<double> betas() const override { return {}; }
  bool flat_hand_mean() const override { return true; }
  int face_code_size() const override { return 0; }
  std::optional<std::vector<float>> face_code(int, int) const override { return std::nullopt; }

  mutable std::atomic<int> loads = 0;

 private:
  std::vector<std::string> names_ = {"a", "b"};
};

LoadRequest schedule(int64_t step) {
  return {static_cast<int>(20 + step % 50), {static_cast<int>(step % 2), 1}};
}

}  // namespace

TEST_CASE("steps come in order, whole, with what was prepared of them") {
  const NumberedCapture capture;
  const int depth = GENERATE(1, 3, 64);
  const auto prepare = [](int64_t step, const LoadRequest& request, const std::vector<Sample>& samples) {
    return std::any(step * 1000 + request.frame + static_cast<int64_t>(samples.size()));
  };
  Loader loader(capture, schedule, prepare, 5, 65, depth);
  for (int64_t step = 5; step < 65; ++step) {
    const LoadedStep loaded = loader.next();
    REQUIRE(loaded.step == step);
    CHECK(loaded.request.frame == schedule(step).frame);
    REQUIRE(loaded.samples.size() == 2);
    CHECK(loaded.samples[0].camera == step % 2);
    CHECK(loaded.samples[1].image.pixels[0] == schedule(step).frame);
    CHECK(std::any_cast<int64_t>(loaded.maps) == step * 1000 + schedule(step).frame + 2);
    if (step % 7 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  CHECK_THROWS_AS(loader.next(), std::logic_error);
}

TEST_CASE("the loader stays within its depth") {
  const NumberedCapture capture;
  Loader loader(capture, schedule, {}, 0, 1000, 3);
  loader.next();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  CHECK(capture.loads <= 2 * (1 + 3));  // one taken, three waiting, two pictures each
}

TEST_CASE("what goes wrong at a step is thrown at that step") {
  const NumberedCapture capture;
  const auto to_thirteen = [](int64_t step) { return LoadRequest{static_cast<int>(step), {0}}; };
  Loader loader(capture, to_thirteen, {}, 10, 20, 8);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // the thread has failed by now
  for (int64_t step = 10; step < 13; ++step) CHECK(loader.next().step == step);
  CHECK_THROWS_WITH(loader.next(), "frame 13 does not load");
  CHECK_THROWS_WITH(loader.next(), "frame 13 does not load");
}

TEST_CASE("a loader that nobody reads ends at once") {
  const NumberedCapture capture;
  for (int i = 0; i < 20; ++i) Loader(capture, schedule, {}, 0, 1'000'000, 2);
  CHECK(capture.loads < 20 * 8);
}
