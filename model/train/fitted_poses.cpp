#include "model/train/fitted_poses.h"

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "host/error.h"
#include "host/io/npz.h"

namespace degas {
namespace {

constexpr std::chrono::seconds save_every(30);

template <typename Value>
double median_of(const std::vector<FittedPose>& poses, Value value) {
  std::vector<double> values;
  for (const FittedPose& pose : poses) {
    if (pose.views > 0) values.push_back(value(pose));
  }
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace

FittedPoses::FittedPoses(std::filesystem::path file, const TrainedAvatar& avatar, const Capture& capture,
                         const PoseFitOptions& options)
    : file_(std::move(file)), fitted_(static_cast<size_t>(capture.frame_count())) {
  for (int frame = 0; frame < capture.frame_count(); ++frame) {
    parameters_.poses.push_back(avatar.best_pose(capture, frame));
    parameters_.frame_numbers.push_back(capture.frame_number(frame));
  }
  parameters_.betas = capture.betas();
  parameters_.flat_hand_mean = true;  // their mean is in the angles
  nlohmann::json by = {{"capture", capture.picture_identity()},
                       {"avatar_steps", avatar.steps_trained()},
                       {"steps", options.steps},
                       {"cameras", nlohmann::json::array()}};
  for (const int camera : options.cameras) by["cameras"].push_back(capture.camera_names()[static_cast<size_t>(camera)]);
  fitted_by_ = by.dump();
}

void FittedPoses::resume() {
  const NpzFile file(file_);
  for (const char* key : {"fitted", "fit"}) {
    if (!file.contains(key))
      throw Error::format("{}: has no '{}': `degas fit-poses` did not write it; leave --resume away", file_.string(),
                          key);
  }
  const std::string by = file.read("fit").text();
  if (by != fitted_by_)
    throw Error::format("{}: was fitted by {}, not by {}; give the same again, or leave --resume away", file_.string(),
                        by, fitted_by_);
  const std::vector<int64_t> fitted = file.read("fitted", {static_cast<int64_t>(fitted_.size())}).integers();
  const SmplxParameters parameters = read_smplx_parameters(file_);
  if (parameters.poses.size() != fitted_.size())
    throw Error::format("{}: has {} frames, the capture has {}; leave --resume away", file_.string(),
                        parameters.poses.size(), fitted_.size());
  for (size_t i = 0; i < fitted_.size(); ++i) {
    if (fitted[i] == 0) continue;
    fitted_[i] = 1;
    parameters_.poses[i] = parameters.poses[i];
  }
}

void FittedPoses::set(int frame, const FittedPose& fitted) {
  parameters_.poses.at(static_cast<size_t>(frame)) = fitted.pose;
  fitted_.at(static_cast<size_t>(frame)) = 1;
  all_.push_back(fitted);
}

void FittedPoses::save() const {
  auto arrays = smplx_arrays(parameters_);
  arrays["fitted"] = NpyArray::from({static_cast<int64_t>(fitted_.size())}, std::span<const uint8_t>(fitted_));
  arrays["fit"] = NpyArray::from_text(fitted_by_);
  write_npz(file_, arrays);
}

std::string FittedPoses::summary() const {
  int pictures = 0, without_picture = 0, left = 0;
  double before = 0, after = 0;
  for (const FittedPose& pose : all_) {
    pictures += pose.views;
    without_picture += pose.views == 0;
    left += pose.views > 0 && pose.loss_after == pose.loss_before;
    before += pose.views * pose.loss_before;
    after += pose.views * pose.loss_after;
  }
  if (pictures == 0) return "no frame was fitted: none of those left has a picture";
  std::string text = fmt::format(
      "{} frames fitted to {} pictures: mean loss {:.5f} -> {:.5f}; the joint that turned most by {:.2f} degrees, the "
      "body moved by {:.1f} mm (medians)",
      all_.size() - static_cast<size_t>(without_picture), pictures, before / pictures, after / pictures,
      median_of(all_, [](const FittedPose& pose) { return pose.degrees_moved; }),
      median_of(all_, [](const FittedPose& pose) { return 1000 * pose.metres_moved; }));
  if (left > 0) text += fmt::format("; {} draw no better and keep their pose", left);
  if (without_picture > 0) text += fmt::format("; {} have no picture and keep their pose", without_picture);
  return text;
}

bool fit_frames(PoseFitter& fitter, FittedPoses& poses, const std::vector<int>& frames,
                const std::function<bool()>& stop_requested,
                const std::function<void(int, const FittedPose&)>& progress) {
  using Clock = std::chrono::steady_clock;
  Clock::time_point saved = Clock::now();
  bool is_whole = true;
  for (size_t i = 0; i < frames.size(); ++i) {
    if (poses.has(frames[i])) continue;
    if (stop_requested()) {
      is_whole = false;
      break;
    }
    const FittedPose fitted = fitter.fit(frames[i]);
    poses.set(frames[i], fitted);
    progress(static_cast<int>(i + 1), fitted);
    if (Clock::now() - saved < save_every) continue;
    poses.save();
    saved = Clock::now();
  }
  poses.save();
  return is_whole;
}

}  // namespace degas
