#include "model/train/fitted_poses.h"

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "host/error.h"
#include "host/io/input_limits.h"
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
    : file_(std::move(file)), done_(static_cast<size_t>(capture.frame_count())) {
  if (std::filesystem::is_directory(file_))
    throw Error::format("{}: is a folder; --out names the file to write", file_.string());
  for (int frame = 0; frame < capture.frame_count(); ++frame) {
    parameters_.poses.push_back(avatar.best_pose(capture, frame));
    parameters_.frame_numbers.push_back(capture.frame_number(frame));
    if (frame > 0 && parameters_.frame_numbers.back() <= parameters_.frame_numbers[static_cast<size_t>(frame) - 1]) {
      throw Error::format(
          "{}: the capture's frames are not in the order of their numbers ({} follows {}), as body parameters have to "
          "be; pack it with rising --frames",
          file_.string(), parameters_.frame_numbers.back(), parameters_.frame_numbers[static_cast<size_t>(frame) - 1]);
    }
  }
  parameters_.betas = avatar.avatar().betas();  // by which the poses are fitted, whatever the capture has
  parameters_.flat_hand_mean = true;            // their mean is in the angles
  nlohmann::json by = {{"avatar", fmt::format("{:016x}", avatar.checksum())},
                       {"capture", capture.identity()},
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
  const std::vector<int64_t> fitted = file.read("fitted", {static_cast<int64_t>(done_.size())}).integers();
  const SmplxParameters parameters = read_smplx_parameters(file_);
  if (parameters.poses.size() != done_.size())
    throw Error::format("{}: has {} frames, the capture has {}; leave --resume away", file_.string(),
                        parameters.poses.size(), done_.size());
  for (size_t i = 0; i < done_.size(); ++i) {
    if (fitted[i] == 0) continue;
    done_[i] = 1;
    parameters_.poses[i] = parameters.poses[i];
  }
}

void FittedPoses::set(int frame, const FittedPose& fitted) {
  parameters_.poses.at(static_cast<size_t>(frame)) = fitted.pose;
  done_.at(static_cast<size_t>(frame)) = 1;
  set_now_.push_back(fitted);
}

void FittedPoses::save() const {
  auto arrays = smplx_arrays(parameters_);
  arrays["fitted"] = NpyArray::from({static_cast<int64_t>(done_.size())}, std::span<const uint8_t>(done_));
  arrays["fit"] = NpyArray::from_text(fitted_by_);
  write_npz(file_, arrays);
}

std::string FittedPoses::summary() const {
  int pictures = 0, without_picture = 0, left = 0;
  double before = 0, after = 0;
  for (const FittedPose& pose : set_now_) {
    pictures += pose.views;
    without_picture += pose.views == 0;
    left += pose.views > 0 && pose.loss_after == pose.loss_before;
    before += pose.views * pose.loss_before;
    after += pose.views * pose.loss_after;
  }
  if (set_now_.empty()) return "no frame was left to fit";
  if (pictures == 0) return "no frame was fitted: none of those left has a picture";
  std::string text = fmt::format(
      "{} frames fitted to {} pictures: mean loss {:.5f} -> {:.5f}; the joint that turned most by {:.2f} degrees, the "
      "body moved by {:.1f} mm (medians)",
      set_now_.size() - static_cast<size_t>(without_picture), pictures, before / pictures, after / pictures,
      median_of(set_now_, [](const FittedPose& pose) { return pose.degrees_moved; }),
      median_of(set_now_, [](const FittedPose& pose) { return 1000 * pose.metres_moved; }));
  if (left > 0) text += fmt::format("; {} draw no better and keep their pose", left);
  if (without_picture > 0) text += fmt::format("; {} have no picture and keep their pose", without_picture);
  return text;
}

bool fit_frames(PoseFitter& fitter, FittedPoses& poses, const std::vector<int>& frames,
                const std::function<void(int, const FittedPose&)>& progress) {
  using Clock = std::chrono::steady_clock;
  Clock::time_point saved = Clock::now();
  bool is_whole = true, has_pictures = false, has_work = false;
  try {
    for (size_t i = 0; i < frames.size() && is_whole; ++i) {
      if (poses.has(frames[i])) continue;
      has_work = true;
      const std::optional<FittedPose> fitted = fitter.fit(frames[i]);
      is_whole = fitted.has_value();
      if (!is_whole) break;
      has_pictures = has_pictures || fitted->views > 0;
      poses.set(frames[i], *fitted);
      progress(static_cast<int>(i + 1), *fitted);
      if (Clock::now() - saved < save_every) continue;
      poses.save();
      saved = Clock::now();
    }
  } catch (...) {
    poses.save();  // what was fitted until here shall not be lost by it
    throw;
  }
  if (is_whole && has_work && !has_pictures)
    throw Error("none of the chosen frames has a picture in the chosen cameras; nothing was fitted");
  poses.save();
  return is_whole;
}

void warn_of_fitted_cameras(const std::filesystem::path& poses, const std::vector<std::string>& cameras) {
  const NpzFile file(poses);
  if (!file.contains("fit")) return;
  const std::string text = file.read("fit").text();
  check_json(text, poses.string());
  const nlohmann::json by = nlohmann::json::parse(text, nullptr, false);
  if (!by.is_object() || !by.contains("cameras") || !by["cameras"].is_array()) return;
  for (const std::string& camera : cameras) {
    if (std::find(by["cameras"].begin(), by["cameras"].end(), nlohmann::json(camera)) == by["cameras"].end()) continue;
    print_warning(fmt::format("{}: its poses were fitted to pictures of {}, which is no unseen camera then",
                              poses.string(), camera));
  }
}

}  // namespace degas
