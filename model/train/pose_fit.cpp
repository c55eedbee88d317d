#include "model/train/pose_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include "host/error.h"
#include "host/ops/image.h"
#include "host/ops/regularizer.h"
#include "host/ops/ssim.h"
#include "host/optim/optimiser.h"
#include "host/random.h"
#include "model/train/boxes.h"
#include "model/train/picture.h"
#include "model/train/training_views.h"

namespace degas {
namespace {

constexpr uint64_t fit_background_stream = 50;  // of Random::of_step; training's are below
constexpr double window_margin = 0.05;          // of the picture's height, around the person
constexpr size_t views_at_once = 8;             // so that a hundred cameras take no more memory than eight
/// On the mean length of the joints' turns, radians: what holds joints of which pictures tell nothing, eyes and
/// fingers, where they were registered. On capture A without it they turned by 5 to 20 degrees, with it by none; the
/// held-out camera has the same PSNR, and 0.1 dB less with ten times as much.
constexpr double turn_weight = 0.05;

/// Angle between two rotations, degrees.
double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Matrix3d turn = rotation_from_axis_angle(a).transpose() * rotation_from_axis_angle(b);
  return Eigen::AngleAxisd(turn).angle() * 180 / std::numbers::pi;
}

/// The smallest that holds both.
Rectangle united(const Rectangle& a, const Rectangle& b) {
  const int left = std::min(a.left, b.left), top = std::min(a.top, b.top);
  return {left, top, std::max(a.left + a.width, b.left + b.width) - left,
          std::max(a.top + a.height, b.top + b.height) - top};
}

}  // namespace

PoseFitter::PoseFitter(Device& device, TrainedAvatar& avatar, const Capture& capture, PoseFitOptions options)
    : device_(device),
      avatar_(avatar),
      capture_(capture),
      options_(std::move(options)),
      codes_(avatar.face_codes(capture)),
      refined_(refined_angles(device, avatar.avatar().body().joint_count())) {
  if (options_.cameras.empty()) {
    throw Error(
        "poses cannot be fitted: of the cameras that training used, the capture has none (what training held out is "
        "not looked at); name others by --cameras");
  }
}

std::vector<PoseFitter::View> PoseFitter::load_views(int frame, const Pose& registered) const {
  const Avatar& avatar = avatar_.avatar();
  const std::vector<Eigen::Vector3d> body = avatar.body().posed_vertices(registered, avatar.betas(), true);
  std::vector<View> views;
  Random random = Random::of_step(avatar_.config().train.seed, fit_background_stream, static_cast<uint64_t>(frame));
  for (const int camera : options_.cameras) {
    // What a picture has over it does not depend on whether another is there.
    std::array<double, 3> background{};
    for (double& channel : background) channel = random.uniform();
    if (!capture_.has_image(frame, camera)) continue;
    const Sample sample = capture_.load(frame, camera);
    Rectangle person = mask_box(sample.mask);
    if (const auto box = projected_box(body, sample.view)) person = united(person, *box);
    const int margin = static_cast<int>(window_margin * sample.view.height);
    const Rectangle window =
        window_around(person, std::min(person.width + 2 * margin, sample.view.width),
                      std::min(person.height + 2 * margin, sample.view.height), sample.view.width, sample.view.height);
    const Image8 image = cropped(sample.image, window.left, window.top, window.width, window.height);
    const Image8 mask = cropped(sample.mask, window.left, window.top, window.width, window.height);
    views.push_back(
        {sample.view.cropped(window.left, window.top, window.width, window.height),
         composite(Tensor::from(device_, {window.height, window.width, 3}, std::span<const uint8_t>(image.pixels)),
                   Tensor::from(device_, {window.height, window.width}, std::span<const uint8_t>(mask.pixels)),
                   background),
         background});
  }
  return views;
}

Tensor PoseFitter::loss(Tape& tape, const CanonicalGaussians& gaussians, const DevicePose& body,
                        const std::vector<View>& views, size_t begin, size_t end) {
  const Splats splats = avatar_.avatar().pose(tape, gaussians, body);
  std::vector<SplatView> shots;
  for (size_t i = begin; i < end; ++i) shots.push_back({views[i].camera, views[i].background});
  const std::vector<SplatImage> images = splat(tape, workspace_, splats, shots, splat_options(avatar_.config().render));
  Tensor sum;
  for (size_t i = begin; i < end; ++i) {
    const Tensor term = l1_ssim_loss(tape, images[i - begin].color, views[i].target, avatar_.config().loss.ssim_weight);
    sum = sum.defined() ? add(tape, sum, term) : term;
  }
  return scale(tape, sum, 1.0 / static_cast<double>(views.size()));
}

Avatar::Signal PoseFitter::signal(const Pose& pose, int frame) {
  return avatar_.avatar().upload(avatar_.avatar().signal(pose, codes_.mean(frame)));
}

double PoseFitter::loss_driven_by(const Pose& pose, int frame, const std::vector<View>& views) {
  Tape untaped(device_, false);
  const Avatar::Signal driven = signal(pose, frame);
  const CanonicalGaussians gaussians = avatar_.avatar().decode(untaped, driven).gaussians;
  double sum = 0;
  for (size_t i = 0; i < views.size(); i += views_at_once) {
    const size_t end = std::min(i + views_at_once, views.size());
    sum += loss(untaped, gaussians, driven.body, views, i, end).to_host<double>()[0];
  }
  return sum;
}

std::optional<FittedPose> PoseFitter::fit(int frame) {
  FittedPose fitted;
  fitted.pose = avatar_.best_pose(capture_, frame);
  const std::vector<View> views = load_views(frame, fitted.pose);
  fitted.views = static_cast<int>(views.size());
  if (views.empty()) return fitted;
  fitted.loss_before = fitted.loss_after = loss_driven_by(fitted.pose, frame, views);

  Tape untaped(device_, false);
  const Avatar::Signal start = signal(fitted.pose, frame);
  const CanonicalGaussians gaussians = avatar_.avatar().decode(untaped, start).gaussians;
  PoseCorrection correction(device_, refined_);
  correction.axis_angles.set_requires_gradient();
  correction.translation.set_requires_gradient();
  OptimiserOptions unclipped;
  unclipped.clip_above = 0;
  Optimiser optimiser(device_, unclipped);
  optimiser.add("axis_angles", correction.axis_angles, 0, UpdateRule::Rprop);
  optimiser.add("translation", correction.translation, 0, UpdateRule::Rprop);
  for (int step = 0; step < options_.steps; ++step) {
    if (options_.stop_requested()) return {};
    for (size_t i = 0; i < views.size(); i += views_at_once) {
      Tape tape(device_);
      const size_t end = std::min(i + views_at_once, views.size());
      Tensor total = loss(tape, gaussians, correction.apply(tape, start.body), views, i, end);
      if (i == 0) total = add(tape, total, scale(tape, mean_length(tape, correction.axis_angles), turn_weight));
      tape.backward(total);
    }
    optimiser.step({avatar_.config().train.pose_learning_rate});
  }

  const Pose before = fitted.pose;
  Pose after = before;
  correction.apply(after);
  const double loss_after = loss_driven_by(after, frame, views);
  if (!(loss_after < fitted.loss_before)) return fitted;
  fitted.pose = after;
  fitted.loss_after = loss_after;
  for (size_t joint = 0; joint < before.axis_angles.size(); ++joint) {
    fitted.degrees_moved =
        std::max(fitted.degrees_moved, degrees_between(before.axis_angles[joint], after.axis_angles[joint]));
  }
  fitted.metres_moved = (after.translation - before.translation).norm();
  return fitted;
}

}  // namespace degas
