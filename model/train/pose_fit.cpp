#include "model/train/pose_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include "host/ops/image.h"
#include "host/ops/regularizer.h"
#include "host/ops/ssim.h"
#include "host/optim/optimiser.h"
#include "host/random.h"
#include "model/train/picture.h"
#include "model/train/training_views.h"

namespace degas {
namespace {

constexpr uint64_t fit_background_stream = 50;  // of Random::of_step; training's are below
constexpr double window_margin = 0.05;          // of the picture's height, around the person
/// On the mean length of the joints' turns, radians: what holds joints of which pictures tell nothing, eyes and
/// fingers, where they were registered. On capture A without it they turned by 5 to 20 degrees, with it by none; the
/// held-out camera has the same PSNR, and 0.1 dB less with ten times as much.
constexpr double turn_weight = 0.05;

/// Angle between two rotations, degrees.
double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Matrix3d turn = rotation_from_axis_angle(a).transpose() * rotation_from_axis_angle(b);
  return Eigen::AngleAxisd(turn).angle() * 180 / std::numbers::pi;
}

}  // namespace

PoseFitter::PoseFitter(Device& device, TrainedAvatar& avatar, const Capture& capture, PoseFitOptions options)
    : device_(device),
      avatar_(avatar),
      capture_(capture),
      options_(std::move(options)),
      codes_(avatar.face_codes(capture)),
      refined_(refined_angles(device, avatar.avatar().body().joint_count())) {}

std::vector<PoseFitter::View> PoseFitter::load_views(int frame) const {
  std::vector<View> views;
  Random random = Random::of_step(avatar_.config().train.seed, fit_background_stream, static_cast<uint64_t>(frame));
  for (const int camera : options_.cameras) {
    // What a picture has over it does not depend on whether another is there.
    std::array<double, 3> background{};
    for (double& channel : background) channel = random.uniform();
    if (!capture_.has_image(frame, camera)) continue;
    const Sample sample = capture_.load(frame, camera);
    const int margin = static_cast<int>(window_margin * sample.view.height);
    const Rectangle person = mask_box(sample.mask);
    const Rectangle window =
        window_around(person, std::min(static_cast<int>(person.width) + 2 * margin, sample.view.width),
                      std::min(static_cast<int>(person.height) + 2 * margin, sample.view.height), sample.view.width,
                      sample.view.height);
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
                        const std::vector<View>& views) {
  const Splats splats = avatar_.avatar().pose(tape, gaussians, body);
  std::vector<SplatView> shots;
  for (const View& view : views) shots.push_back({view.camera, view.background});
  const std::vector<SplatImage> images = splat(tape, workspace_, splats, shots, splat_options(avatar_.config().render));
  Tensor sum;
  for (size_t i = 0; i < views.size(); ++i) {
    const Tensor term = l1_ssim_loss(tape, images[i].color, views[i].target, avatar_.config().loss.ssim_weight);
    sum = sum.defined() ? add(tape, sum, term) : term;
  }
  return scale(tape, sum, 1.0 / static_cast<double>(views.size()));
}

FittedPose PoseFitter::fit(int frame) {
  FittedPose fitted;
  fitted.pose = avatar_.best_pose(capture_, frame);
  const std::vector<View> views = load_views(frame);
  fitted.views = static_cast<int>(views.size());
  if (views.empty()) return fitted;

  Tape untaped(device_, false);
  const Avatar::Signal signal = avatar_.avatar().upload(avatar_.avatar().signal(capture_, frame, codes_.mean(frame)));
  const CanonicalGaussians gaussians = avatar_.avatar().decode(untaped, signal).gaussians;
  const DevicePose start = make_device_pose(device_, avatar_.avatar().driven_pose(fitted.pose));
  PoseCorrection correction(device_, refined_);
  OptimiserOptions unclipped;
  unclipped.clip_above = 0;
  Optimiser optimiser(device_, unclipped);
  for (Tensor* part : {&correction.axis_angles, &correction.translation}) {
    part->set_requires_gradient();
    optimiser.add(part == &correction.translation ? "translation" : "axis_angles", *part, 0, UpdateRule::Rprop);
  }
  const auto value = [&] {
    return loss(untaped, gaussians, correction.apply(untaped, start), views).to_host<float>()[0];
  };
  fitted.loss_before = fitted.loss_after = value();
  for (int step = 0; step < options_.steps; ++step) {
    Tape tape(device_);
    const Tensor turned = scale(tape, mean_length(tape, correction.axis_angles), turn_weight);
    tape.backward(add(tape, loss(tape, gaussians, correction.apply(tape, start), views), turned));
    optimiser.step({avatar_.config().train.pose_learning_rate});
  }
  const double after = value();
  if (!(after < fitted.loss_before)) return fitted;

  fitted.loss_after = after;
  const Pose before = fitted.pose;
  correction.apply(fitted.pose);
  for (size_t joint = 0; joint < before.axis_angles.size(); ++joint) {
    fitted.degrees_moved =
        std::max(fitted.degrees_moved, degrees_between(before.axis_angles[joint], fitted.pose.axis_angles[joint]));
  }
  fitted.metres_moved = (fitted.pose.translation - before.translation).norm();
  return fitted;
}

}  // namespace degas
