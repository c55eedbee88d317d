#include "model/data/corrupted_capture.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "host/random.h"
#include "model/body/body_model.h"
#include "model/data/wrapped_capture.h"

namespace degas {
namespace {

/// Streams of Random::of_step; training's lie below 100.
enum Stream : uint64_t { PoseStream = 100, MaskStream, CodeStream };

constexpr unsigned char furniture = 90;

/// A vector of any direction whose length is evenly spread up to `longest`.
Eigen::Vector3d short_vector(Random& random, double longest) {
  const Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
  return direction.normalized() * (random.uniform() * longest);
}

/// Changes the mask; colours stay below it, and unseen ones are black.
void set_mask(Sample& sample, int x, int y, int value) {
  unsigned char& mask = *sample.mask.at(x, y);
  unsigned char* color = sample.image.at(x, y);
  for (int channel = 0; channel < 3; ++channel) {
    if (value < mask) color[channel] = static_cast<unsigned char>(color[channel] * value / mask);
  }
  mask = static_cast<unsigned char>(value);
}

void shift_mask(Sample& sample, Random& random) {
  const Image8 before = sample.mask;
  const double angle = 2 * std::numbers::pi * random.uniform(), length = before.height / 16.0;
  const int dx = static_cast<int>(std::lround(length * std::cos(angle)));
  const int dy = static_cast<int>(std::lround(length * std::sin(angle)));
  for (int y = 0; y < before.height; ++y) {
    for (int x = 0; x < before.width; ++x) {
      const bool inside = x - dx >= 0 && x - dx < before.width && y - dy >= 0 && y - dy < before.height;
      set_mask(sample, x, y, inside ? *before.at(x - dx, y - dy) : 0);
    }
  }
}

/// A rectangle around one of the person's pixels, nobody in it or nothing else.
void overwrite_mask(Sample& sample, Random& random, bool is_person) {
  const int width = sample.mask.width, height = sample.mask.height;
  std::vector<int> person;
  for (int i = 0; i < width * height; ++i) {
    if (*sample.mask.at(i % width, i / width) >= 128) person.push_back(i);
  }
  if (person.empty()) return;
  const int center = person[static_cast<size_t>(random.index(static_cast<int64_t>(person.size())))];
  const int left = center % width - width / 8, top = center / width - height / 8;
  for (int y = std::max(top, 0); y < std::min(top + height / 4, height); ++y) {
    for (int x = std::max(left, 0); x < std::min(left + width / 4, width); ++x) {
      const bool was_nobody = *sample.mask.at(x, y) == 0;
      set_mask(sample, x, y, is_person ? 255 : 0);
      if (is_person && was_nobody) std::fill_n(sample.image.at(x, y), 3, furniture);
    }
  }
}

class CorruptedCapture final : public WrappedCapture {
 public:
  CorruptedCapture(std::unique_ptr<Capture> source, const CorruptionConfig& corruption)
      : WrappedCapture(std::move(source)), corruption_(corruption) {}

  std::string identity() const override {
    return fmt::format("{}, corrupted by {} degrees, {} metres, {} of masks, {} of codes, seed {}", source().identity(),
                       corruption_.registration_degrees, corruption_.registration_metres, corruption_.wrong_masks,
                       corruption_.missing_codes, corruption_.seed);
  }

  Pose pose(int frame) const override {
    Pose pose = source().pose(frame);
    if (corruption_.registration_degrees == 0 && corruption_.registration_metres == 0) return pose;
    Random random = draws(PoseStream, frame);
    const double largest = corruption_.registration_degrees * std::numbers::pi / 180;
    for (Eigen::Vector3d& axis_angle : pose.axis_angles) {
      const Eigen::Matrix3d turn = rotation_from_axis_angle(short_vector(random, largest));
      const Eigen::AngleAxisd turned(rotation_from_axis_angle(axis_angle) * turn);
      axis_angle = turned.angle() * turned.axis();
    }
    pose.translation += short_vector(random, corruption_.registration_metres);
    return pose;
  }

  Sample load(int frame, int camera) const override {
    Sample sample = source().load(frame, camera);
    Random random = draws(MaskStream, frame * static_cast<int64_t>(camera_names().size()) + camera);
    if (random.uniform() >= corruption_.wrong_masks) return sample;
    const Sample right = sample;
    const int64_t kind = random.index(3);
    if (kind == 0) {
      shift_mask(sample, random);
    } else {
      overwrite_mask(sample, random, kind == 1);
    }
    // A picture without anybody is no sample.
    const auto& mask = sample.mask;
    for (int i = 0; i < mask.width * mask.height; ++i) {
      if (*mask.at(i % mask.width, i / mask.width) > 0) return sample;
    }
    return right;
  }

  bool has_face_code(int frame, int camera) const override {
    return draws(CodeStream, frame).uniform() >= corruption_.missing_codes && source().has_face_code(frame, camera);
  }
  std::optional<std::vector<float>> face_code(int frame, int camera) const override {
    return has_face_code(frame, camera) ? source().face_code(frame, camera) : std::nullopt;
  }

 private:
  Random draws(Stream stream, int64_t index) const {
    return Random::of_step(corruption_.seed, stream, static_cast<uint64_t>(index));
  }

  CorruptionConfig corruption_;
};

}  // namespace

bool corrupts(const CorruptionConfig& corruption) {
  CorruptionConfig nothing;
  nothing.seed = corruption.seed;
  return corruption != nothing;
}

std::unique_ptr<Capture> corrupted(std::unique_ptr<Capture> source, const CorruptionConfig& corruption) {
  if (!corrupts(corruption)) return source;
  return std::make_unique<CorruptedCapture>(std::move(source), corruption);
}

}  // namespace degas
