#include "model/data/corrupted_capture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include "tests/model/train/fake_capture.h"
#include "tests/support/catch.h"

using namespace degas;
using namespace degas::test;

namespace {

constexpr int frames = 60;

/// Of 60 frames and four cameras, all with codes, where the person is a grey box.
std::unique_ptr<FakeCapture> recording() {
  class GreyCapture : public FakeCapture {
    Sample load(int frame, int camera) const override {
      Sample sample = FakeCapture::load(frame, camera);
      for (size_t i = 0; i < sample.image.pixels.size(); ++i)
        sample.image.pixels[i] = static_cast<uint8_t>(sample.mask.pixels[i / 3] * 200 / 255);
      return sample;
    }
  };
  auto capture = std::make_unique<GreyCapture>();
  capture->frames = frames;
  capture->box_height = 20;  // and a pixel more in each frame
  capture->code = [](int frame, int camera) { return std::vector<float>{static_cast<float>(frame), 1.0F * camera}; };
  return capture;
}

std::unique_ptr<Capture> with(CorruptionConfig corruption, uint64_t seed = 1) {
  corruption.seed = seed;
  return corrupted(recording(), corruption);
}

CorruptionConfig registration(double degrees, double metres) {
  CorruptionConfig corruption;
  corruption.registration_degrees = degrees;
  corruption.registration_metres = metres;
  return corruption;
}

CorruptionConfig wrong_masks(double share) {
  CorruptionConfig corruption;
  corruption.wrong_masks = share;
  return corruption;
}

double degrees(const Eigen::Vector3d& axis_angle) {
  return axis_angle.norm() * 180 / std::numbers::pi;
}

}  // namespace

TEST_CASE("nothing wrong leaves the capture itself") {
  std::unique_ptr<Capture> capture = recording();
  const Capture* before = capture.get();
  CorruptionConfig nothing;
  nothing.seed = 2;
  CHECK(corrupted(std::move(capture), nothing).get() == before);
}

TEST_CASE("a corrupted registration turns every joint and moves the body, evenly up to the limits") {
  const auto capture = with(registration(3, 0.01));
  std::vector<double> angles, lengths;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int frame = 0; frame < frames; ++frame) {
    const Pose pose = capture->pose(frame);
    for (const Eigen::Vector3d& axis_angle : pose.axis_angles) {
      angles.push_back(degrees(axis_angle));
      mean += axis_angle.normalized();
    }
    lengths.push_back(pose.translation.norm());
  }
  const auto average = [](const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
  };
  const auto most = [](const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); };
  CHECK(most(angles) <= 3 + 1e-9);
  CHECK(most(angles) > 2.95);
  CHECK(average(angles) == Approx(1.5).margin(0.1));
  CHECK(most(lengths) <= 0.01);
  CHECK(average(lengths) == Approx(0.005).margin(0.0015));
  CHECK((mean / static_cast<double>(angles.size())).norm() < 0.06);  // directions of all kinds
}

TEST_CASE("the turn comes on top of the pose") {
  auto source = recording();
  source->jaw = {0.3, -0.2, 0.1};
  const Eigen::Vector3d jaw = source->jaw;
  const auto capture = corrupted(std::move(source), registration(3, 0));
  const auto matrix = [](const Eigen::Vector3d& turn) {
    return Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  };
  const Eigen::AngleAxisd between(matrix(jaw).transpose() * matrix(capture->pose(0).axis_angles[JawJoint]));
  CHECK(between.angle() > 0);
  CHECK(between.angle() * 180 / std::numbers::pi <= 3);
  CHECK(capture->pose(0).translation == Eigen::Vector3d::Zero());
}

TEST_CASE("where the registration is right it stays, bit for bit") {
  auto source = recording();
  source->jaw = {3.5, 0.1, 0};  // beyond half a turn, which a matrix would not tell
  const auto capture = corrupted(std::move(source), wrong_masks(0.5));
  CHECK(capture->pose(3).axis_angles[JawJoint] == Eigen::Vector3d(3.5, 0.1, 0));
  CHECK(capture->pose(3).translation == Eigen::Vector3d::Zero());
}

TEST_CASE("a share of the masks is wrong, colours stay within the mask, and somebody is in every picture") {
  const auto right = recording();
  const auto capture = with(wrong_masks(0.2));
  int wrong = 0, taken = 0, added = 0, outside = 0;
  for (int frame = 0; frame < frames; ++frame) {
    for (int camera = 0; camera < 4; ++camera) {
      const Sample sample = capture->load(frame, camera), before = right->load(frame, camera);
      int less = 0, more = 0, colors = 0, person = 0;
      for (size_t i = 0; i < sample.mask.pixels.size(); ++i) {
        less += sample.mask.pixels[i] < before.mask.pixels[i];
        more += sample.mask.pixels[i] > before.mask.pixels[i];
        person += sample.mask.pixels[i] > 0;
        for (size_t k = 0; k < 3; ++k) {
          outside += sample.image.pixels[3 * i + k] > sample.mask.pixels[i];
          colors += sample.image.pixels[3 * i + k] != before.image.pixels[3 * i + k];
        }
      }
      wrong += less + more > 0;
      taken += less > 0;
      added += more > 0;
      if (less + more == 0) CHECK(colors == 0);
      CHECK(person > 0);
    }
  }
  CAPTURE(wrong, taken, added);
  CHECK(wrong > 240 * 0.2 - 25);  // four standard deviations of a binomial draw
  CHECK(wrong < 240 * 0.2 + 25);
  CHECK(taken > wrong / 3);  // two of the three kinds take, two add
  CHECK(added > wrong / 3);
  CHECK(outside == 0);
}

TEST_CASE("a picture whose whole person would be cut away keeps its mask") {
  auto source = recording();
  source->box_width = 3;
  source->box_height = 3;  // the rectangle is 25 x 30 pixels
  source->frames = 1;
  CorruptionConfig corruption = wrong_masks(0.999);
  corruption.seed = 7;
  const auto capture = corrupted(std::move(source), corruption);
  for (int camera = 0; camera < 4; ++camera) {
    const Sample sample = capture->load(0, camera);
    CHECK(*std::max_element(sample.mask.pixels.begin(), sample.mask.pixels.end()) == 255);
  }
}

TEST_CASE("frames lose their codes in all cameras") {
  CorruptionConfig corruption;
  corruption.missing_codes = 0.3;
  const auto capture = with(corruption);
  int missing = 0;
  for (int frame = 0; frame < frames; ++frame) {
    const bool has = capture->has_face_code(frame, 0);
    missing += !has;
    for (int camera = 0; camera < 4; ++camera) {
      CHECK(capture->has_face_code(frame, camera) == has);
      CHECK(capture->face_code(frame, camera).has_value() == has);
    }
  }
  CHECK(missing > 18 - 12);
  CHECK(missing < 18 + 12);
  CHECK(capture->face_code_size() == 2);
}

TEST_CASE("what is wrong is told by the seed alone, and the identity tells it") {
  CorruptionConfig all = registration(3, 0.01);
  all.wrong_masks = all.missing_codes = 0.3;
  const auto one = with(all), again = with(all), other = with(all, 2);
  int differing = 0;
  for (const int frame : {7, 0, 7}) {
    CHECK(one->pose(frame).axis_angles == again->pose(frame).axis_angles);
    CHECK(one->pose(frame).axis_angles != other->pose(frame).axis_angles);
    CHECK(one->load(frame, 2).mask.pixels == again->load(frame, 2).mask.pixels);
  }
  for (int frame = 0; frame < frames; ++frame)
    differing += one->has_face_code(frame, 0) != other->has_face_code(frame, 0);
  CHECK(differing > 0);
  CHECK(one->identity() == again->identity());
  CHECK(one->identity() != other->identity());
  CHECK(one->identity() != with(wrong_masks(0.3))->identity());
  CHECK(one->picture_identity() == recording()->picture_identity());
}
