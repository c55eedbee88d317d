#include "model/train/prepared_step.h"

#include "host/random.h"
#include "model/train/boxes.h"

namespace degas {
namespace {

/// Streams of Random::of_step; the view schedule has 1 and 2.
enum Stream : uint64_t { face_code_stream = 3, background_stream = 4 };

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
  return avatar_.signal(capture_, frame, codes_.mixture(frame, code_random));
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
