#include "model/train/trainer.h"

#include <algorithm>
#include <any>
#include <cmath>
#include <numbers>

#include "host/error.h"
#include "host/random.h"
#include "model/loss/metrics.h"
#include "model/train/picture.h"
#include "model/train/skip_cause.h"

namespace degas {
namespace {

enum ParameterGroup { network_group = 0, pose_group = 1 };

constexpr uint64_t noise_stream = 5;  // of Random::of_step; prepared_step.cpp and view_schedule.cpp have 1 to 4
constexpr int validation_views = 4;
constexpr std::array<double, 3> white = {1, 1, 1};

OptimiserOptions optimiser_options(const TrainConfig& train) {
  OptimiserOptions options;
  options.beta1 = train.beta1;
  options.beta2 = train.beta2;
  options.epsilon = train.epsilon;
  options.clip_above = train.gradient_clip.norm;
  options.clip_to = train.gradient_clip.scale;
  options.spike_limit = train.spike_limit;
  return options;
}

Tensor target_of(Device& device, const TrainingPicture& picture) {
  const int64_t height = picture.view.height, width = picture.view.width;
  return composite(Tensor::from(device, {height, width, 3}, std::span<const uint8_t>(picture.image.pixels)),
                   Tensor::from(device, {height, width}, std::span<const uint8_t>(picture.mask.pixels)),
                   picture.background);
}

}  // namespace

Trainer::Trainer(Device& device, const Config& config, const Capture& capture, const RunFolder& run)
    : device_(device),
      config_(with_camera_names(config, capture)),
      capture_(capture),
      run_(run),
      avatar_(device, config, BodyModel::load(run.body_file()), capture.betas(),
              required_face_code_size(capture, config)),
      views_(capture, config.data),
      schedule_(views_.training, config.train.views_per_step, config.train.seed),
      codes_(capture, allowed_cameras(capture, config.data), config.face,
             [this](int frame, const Camera& camera) { return avatar_.frontal_angle(capture_.pose(frame), camera); }),
      validation_codes_(codes_),
      preparer_(config_, capture, avatar_, views_, codes_),
      loss_(device, config, avatar_.base().log_scales,
            group_rows(device, avatar_.main_joints(), avatar_.body().joint_count())),
      optimiser_(device, optimiser_options(config.train)) {
  for (const ParameterStore::Parameter& parameter : avatar_.network().parameters().parameters()) {
    Tensor(parameter.value).set_requires_gradient();
    optimiser_.add(parameter.name, parameter.value, network_group);
  }
  if (!config_.train.refine_poses) return;
  const Tensor refined = refined_angles(device, avatar_.body().joint_count());
  for (const LoadRequest& views : views_.training) {
    PoseCorrection correction(device, refined);
    correction.axis_angles.set_requires_gradient();
    correction.translation.set_requires_gradient();
    optimiser_.add(PoseCorrection::name(views.frame, "axis_angles"), correction.axis_angles, pose_group,
                   UpdateRule::Rprop);
    optimiser_.add(PoseCorrection::name(views.frame, "translation"), correction.translation, pose_group,
                   UpdateRule::Rprop);
    corrections_.emplace(views.frame, correction);
  }
}

double Trainer::learning_rate_factor(double fraction) const {
  const double warm_up = std::min(
      1.0, static_cast<double>(step_ + 1) / static_cast<double>(std::max<int64_t>(1, config_.train.warm_up_steps)));
  if (config_.train.schedule == LearningRateSchedule::Constant) return warm_up;
  // Along the budget's fraction rather than the steps, so that it fits a budget in minutes too.
  const double last = config_.train.final_learning_rate_factor;
  return warm_up * (last + (1 - last) * 0.5 * (1 + std::cos(std::numbers::pi * std::min(fraction, 1.0))));
}

Splats Trainer::posed_splats(Tape& tape, const Avatar::Signal& signal, const CanonicalGaussians& gaussians,
                             int frame) const {
  const auto correction = corrections_.find(frame);
  return avatar_.pose(tape, gaussians,
                      correction == corrections_.end() ? signal.body : correction->second.apply(tape, signal.body));
}

std::vector<SplatImage> Trainer::draw(Tape& tape, const Splats& splats, const std::vector<TrainingPicture>& pictures) {
  std::vector<SplatView> views;
  for (const TrainingPicture& picture : pictures) views.push_back({picture.view, picture.background});
  return splat(tape, workspace_, splats, views, splat_options(config_.render));
}

Trainer::Step Trainer::forward(Tape& tape, const LoadedStep& loaded) {
  const auto& prepared = std::any_cast<const PreparedStep&>(loaded.maps);
  device_.set_stage({"decode"});
  const Avatar::Signal signal = avatar_.upload(prepared.signal);
  const Avatar::Decoded decoded =
      avatar_.decode(tape, signal, Random::of_step(config_.train.seed, noise_stream, loaded.step).next());
  const CanonicalGaussians& gaussians = decoded.gaussians;
  device_.set_stage({"pose"});
  const Splats splats = posed_splats(tape, signal, gaussians, loaded.request.frame);
  device_.set_stage({"splat"});
  const std::vector<SplatImage> images = draw(tape, splats, prepared.pictures);
  std::vector<LossView> views;
  for (size_t k = 0; k < images.size(); ++k) {
    const TrainingPicture& picture = prepared.pictures[k];
    views.push_back({images[k].color, target_of(device_, picture), picture.region, picture.background});
  }
  device_.set_stage({"losses"});
  const LossMaps maps{gaussians.offsets, gaussians.log_scales, gaussians.opacity_logits, decoded.divergence};
  return {loss_.evaluate(tape, views, maps, loaded.step), gaussians.opacities, gaussians.log_scales};
}

Trainer::Step Trainer::train_step(const LoadedStep& loaded, double fraction) {
  Tape tape(device_);
  const Step step = forward(tape, loaded);
  tape.backward(step.terms.total);
  device_.set_stage({"optimiser"});
  const double factor = learning_rate_factor(fraction);
  optimiser_.step({factor * config_.train.learning_rate, factor * config_.train.pose_learning_rate});
  device_.set_stage({});
  return step;
}

double Trainer::validation_psnr() {
  const size_t count = std::min<size_t>(validation_views, views_.validation.size());
  double total = 0;
  device_.set_stage({"validation"});
  for (size_t i = 0; i < count; ++i) {
    const FrameCamera& view = views_.validation[i * views_.validation.size() / count];
    const TrainingPicture picture = preparer_.picture(capture_.load(view.frame, view.camera), white);
    Tape tape(device_, false);
    const Avatar::Signal signal =
        avatar_.upload(avatar_.signal(capture_, view.frame, validation_codes_.mean(view.frame)));
    const Splats splats = posed_splats(tape, signal, avatar_.decode(tape, signal).gaussians, view.frame);
    const Tensor image = draw(tape, splats, {picture}).front().color;
    total += psnr(image.to_host<float>(), target_of(device_, picture).to_host<float>());
  }
  device_.set_stage({});
  return total / static_cast<double>(count);
}

std::string Trainer::skip_cause(const Optimiser::Counters& counters) {
  const Optimiser::Counters::Skipped& skipped = counters.last_skipped;
  if (skipped.step < 0 || skipped.step == told_skip_) return "";
  told_skip_ = skipped.step;
  // Frames of a step and all that is drawn at random follow from its number.
  const LoadRequest views = schedule_.plan(skipped.step);
  std::vector<Sample> samples;
  for (const int camera : views.cameras) samples.push_back(capture_.load(views.frame, camera));
  FaceCodes codes(validation_codes_);  // the loader's thread is at the trainer's own
  const PreparedStep prepared =
      StepPreparer(config_, capture_, avatar_, views_, codes).prepare(skipped.step, views, samples);
  Tape tape(device_, false);
  const auto losses = forward(tape, {skipped.step, views, {}, prepared}).terms.values();
  return skip_text(skipped, views, capture_, {is_finite(prepared.signal.pose), non_finite_parameter(), losses});
}

std::string Trainer::non_finite_parameter() const {
  for (const Optimiser::Parameter& parameter : optimiser_.parameters()) {
    if (!is_finite(parameter.value.to_host<float>())) return parameter.name;
  }
  return "";
}

void Trainer::require_progress(const Optimiser::Counters& counters) {
  if (counters.skipped_in_a_row < config_.train.max_skipped_steps) return;
  const std::string cause = skip_cause(counters);
  throw Error::format(
      "training stopped at step {}: {} steps in a row were skipped; {}{}{}; lower "
      "train.learning_rate, look for broken pictures and parameters, or raise train.spike_limit where it is a spike",
      step_, counters.skipped_in_a_row, cause, cause.empty() ? "" : "; ",
      run_.has_checkpoint() ? "the last good checkpoint stands" : "there is no checkpoint yet");
}

TrainingReport Trainer::make_report(const Step& step, const Optimiser::Counters& counters, double fraction) {
  TrainingReport report;
  report.step = step_;
  report.fraction = fraction;
  report.losses = step.terms.values();
  const TexelFaults faults =
      count_faults(step.opacities, step.log_scales, avatar_.base().log_scales, config_.loss.scale_limit);
  report.dead_texels = faults.dead;
  report.exploded_texels = faults.exploded;
  report.skipped = counters.skipped;
  report.gradient_norm = counters.last_norm;
  report.skip_cause = skip_cause(counters);
  report.learning_rate = config_.train.learning_rate * learning_rate_factor(fraction);
  return report;
}

TrainingEnd Trainer::run(const TrainingBudget& budget, const std::function<void(const TrainingReport&)>& report) {
  BudgetClock clock(budget, step_, minutes_spent_);
  Loader loader(
      capture_, [this](int64_t step) { return schedule_.plan(step); },
      [this](int64_t step, const LoadRequest& request, const std::vector<Sample>& samples) {
        return std::any(preparer_.prepare(step, request, samples));
      },
      step_, budget.iterations);
  const int64_t first_step = step_;
  double last_report = 0;
  int64_t last_reported_step = step_;
  bool save_due = false;
  TrainingEnd end = TrainingEnd::Finished;
  while (step_ < budget.iterations) {
    if (budget.stop_requested())
      end = TrainingEnd::Interrupted;
    else if (clock.fraction() >= 1)
      end = TrainingEnd::OutOfTime;
    if (end != TrainingEnd::Finished) break;

    const auto next = [&] {
      try {
        return loader.next();
      } catch (const Error&) {
        // It would not be read at the next try either; the steps until here shall not be lost by it.
        if (step_ > first_step) save_unless_broken();
        throw;
      }
    };
    const Step step = train_step(next(), clock.fraction());
    ++step_;
    clock.count_step();
    const bool last = step_ == budget.iterations;
    const auto due = [&](int64_t every) { return every > 0 && (step_ % every == 0 || last); };
    const bool validates = due(config_.train.validation_every) && !views_.validation.empty();
    const bool reports = due(config_.train.log_every) || validates;
    save_due = save_due || due(config_.train.checkpoint_every);
    // Reading the counters waits for the device, so it is not done at every step.
    Optimiser::Counters counters;
    if (reports || save_due || last || step_ % config_.train.max_skipped_steps == 0) {
      counters = optimiser_.counters();
      require_progress(counters);
    }
    if (reports) {
      TrainingReport line = make_report(step, counters, clock.fraction());
      line.seconds = clock.seconds();
      line.steps_per_second = static_cast<double>(step_ - last_reported_step) / (line.seconds - last_report);
      if (validates) line.validation_psnr = validation_psnr();
      last_report = clock.seconds();
      last_reported_step = step_;
      run_.append_history(history_line(line));
      report(line);
    }
    if (budget.minutes) minutes_spent_ = clock.minutes();
    // Parameters that went wrong may be what steps fail by: the last good checkpoint stays until one succeeds.
    if (save_due && !last && counters.skipped_in_a_row == 0) {
      save();
      save_due = false;
    }
  }
  if (budget.minutes) minutes_spent_ = clock.minutes();
  save_unless_broken();
  return end;
}

}  // namespace degas
