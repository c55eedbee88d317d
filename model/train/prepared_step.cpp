#include "model/train/prepared_step.h"

#include <cmath>

#include "host/random.h"
#include "model/train/boxes.h"

namespace degas {
namespace {

/// Streams of Random::of_step; the view schedule has 1 and 2.
enum Stream : uint64_t { face_code_stream = 3, background_stream = 4, jitter_stream = 6 };

/// Normal noise of `fraction` of the code's root mean square on each of its values.
void add_jitter(std::vector<float>& code, double fraction, Random& random) {
  if (fraction == 0 || code.empty()) return;
  double square = 0;
  for (float value : code) square += static_cast<double>(value) * value;
  const double deviation = fraction * std::sqrt(square / static_cast<double>(code.size()));
  for (float& value : code) value += static_cast<float>(deviation * random.normal());
}

}  // namespace

TrainingPicture StepPreparer::picture(const Sample& sample, const std::array<double, 3>& background) const {
  TrainingPicture picture{sample.view, sample.image, sample.mask, background, std::nullopt};
  if (views_.window_width > 0) {
    const Rectangle window = window_around(mask_box(sample.mask), views_.window_width, views_.window_height,
                                           sample.view.width, sample.view.height);
    picture.view = sample.view.cropped(window.left, window.top, window.width, window.height);
    picture.image = cropped(sample.image, window.left, window.top, window.width, window.height);
    picture.mask = cropped(sample.mask, window.left, window.top, window.width, window.height);
  }
  if (config_.loss.lpips_weight > 0 && config_.loss.lpips_region == LossRegion::Face) {
    picture.region = face_box(avatar_.body(), capture_.pose(sample.frame), avatar_.betas(), picture.view);
  }
  if (config_.loss.lpips_weight > 0 && config_.loss.lpips_region == LossRegion::Person) {
    picture.region = mask_box(picture.mask);
  }
  return picture;
}

DrivingSignal StepPreparer::signal(int64_t step, int frame) const {
  Random code_random = Random::of_step(config_.train.seed, face_code_stream, step);
  Random jitter = Random::of_step(config_.train.seed, jitter_stream, step);
  std::vector<float> code = codes_.mixture(frame, code_random);
  add_jitter(code, config_.train.code_jitter, jitter);
  if (config_.train.pose_jitter == 0) return avatar_.signal(capture_, frame, std::move(code));
  Pose seen = avatar_.registered_pose(capture_, frame);
  const Pose registered = seen;
  for (size_t joint = 1; joint < seen.axis_angles.size(); ++joint) {
    for (double& angle : seen.axis_angles[joint]) angle += config_.train.pose_jitter * jitter.normal();
  }
  // The network sees the jittered pose; the Gaussians are posed by the registered one.
  DrivingSignal signal = avatar_.signal(seen, std::move(code));
  signal.pose = avatar_.driven_pose(registered);
  return signal;
}

PreparedStep StepPreparer::prepare(int64_t step, const LoadRequest& request, const std::vector<Sample>& samples) const {
  Random background_random = Random::of_step(config_.train.seed, background_stream, step);
  PreparedStep prepared{signal(step, request.frame), {}};
  for (const Sample& sample : samples) {
    std::array<double, 3> background{};
    if (config_.train.random_background) {
      for (double& channel : background) channel = background_random.uniform();
    }
    prepared.pictures.push_back(picture(sample, background));
  }
  return prepared;
}

}  // namespace degas
