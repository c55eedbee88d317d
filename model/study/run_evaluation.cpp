#include "model/study/run_evaluation.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "host/device/tuner.h"
#include "host/error.h"
#include "model/data/registration.h"
#include "model/data/selection.h"
#include "model/study/measures.h"
#include "model/study/recorded_command.h"
#include "model/study/same_recording.h"
#include "model/train/evaluator.h"
#include "model/train/fitted_poses.h"

namespace degas {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

using Progress = std::function<void(double part, const std::string& text)>;

/// An avatar with what drives it, on a device of its own: so that the memory that is measured is its own.
struct DrivenAvatar {
  Device device;
  TrainedAvatar avatar;
  /// As training knew it.
  std::unique_ptr<Capture> capture;

  DrivenAvatar(const StudySetup& setup, const StudyEvaluation& evaluation, const EvaluatedRun& run)
      : device(setup.device), avatar(device, RunFolder(run.folder)), capture(open_evaluation(setup, evaluation)) {
    set_tuner(device, setup.tune);
    if (evaluation.name == "view") capture = std::make_unique<SameRecording>(std::move(capture), run.pictures);
    capture = avatar.as_registered(std::move(capture));
  }
};

/// Of all frames, to a file; goes on where it was stopped.
void fit_poses(const StudySetup& setup, const StudyEvaluation& evaluation, const EvaluatedRun& run,
               const fs::path& file, const Progress& progress) {
  DrivenAvatar driven(setup, evaluation, run);
  PoseFitOptions options;
  options.cameras = driven.avatar.seen_cameras(*driven.capture);
  options.stop_requested = setup.stop_requested;
  const auto begun = [&] { return FittedPoses(file, driven.avatar, *driven.capture, options); };
  FittedPoses poses = begun();
  try {
    if (fs::exists(file)) poses.resume();
  } catch (const Error&) {
    poses = begun();  // of an avatar that was trained less: made anew
  }
  PoseFitter fitter(driven.device, driven.avatar, *driven.capture, options);
  const std::vector<int> frames = selected_frames({}, driven.capture->frame_count(), "--frames");
  const bool is_whole = fit_frames(fitter, poses, frames, [&](int done, const FittedPose&) {
    progress(static_cast<double>(done) / static_cast<double>(frames.size()),
             fmt::format("fitting frame {} of {}", done, frames.size()));
  });
  if (!is_whole) throw Error("interrupted while poses were fitted");
}

/// By which anyone can measure the same; poses: empty, or the file of fit_poses.
std::string commands(const StudySetup& setup, const StudyEvaluation& evaluation, const EvaluatedRun& run,
                     const fs::path& poses, const std::vector<std::string>& cameras, const fs::path& output) {
  std::vector<std::string> words = {"--run", run.folder.string(), "--data", evaluation.data.string()};
  const auto add = [](std::vector<std::string>& words, const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
  };
  if (!evaluation.codes.empty()) add(words, {"--codes", evaluation.codes.string()});
  add(words, shared_words(setup));
  std::vector<std::string> eval = {"eval"}, fit = {"fit-poses"};
  add(eval, words);
  add(eval, setup.metrics);
  const fs::path& registration = evaluation.name == "view" ? setup.capture.poses : poses;
  if (!registration.empty()) add(eval, {"--poses", registration.string()});
  add(eval, {"--cameras", fmt::format("{}", fmt::join(cameras, ",")), "--out", output.string()});
  if (poses.empty()) return command_text(eval);
  add(fit, words);
  add(fit, {"--out", poses.string()});
  return command_text(fit) + " && " + command_text(eval);
}

struct Measurement {
  json found;
  double memory_mib;  ///< the peak
};

/// poses: empty, or the file of fit_poses.
Measurement measure(const StudySetup& setup, const StudyEvaluation& evaluation, const EvaluatedRun& run,
                    const fs::path& poses, const fs::path& output, const Progress& progress) {
  DrivenAvatar driven(setup, evaluation, run);
  std::unique_ptr<Capture> as_recorded;
  EvaluationOptions options;
  if (!poses.empty()) {
    driven.capture = with_registration(std::move(driven.capture), poses);
    as_recorded = open_evaluation(setup, evaluation);
    options.boxes = as_recorded.get();
  }
  const Capture& capture = *driven.capture;
  options.cameras = evaluation_cameras(setup, evaluation, capture);
  const std::vector<int> few = milestone_frames(capture.frame_count());
  options.frames = run.is_finished ? selected_frames({}, capture.frame_count(), "--frames") : few;
  options.output = output;
  options.networks = setup.networks(driven.device, driven.avatar.config().loss);
  options.stop_requested = setup.stop_requested;
  const EvaluationSummary summary = evaluate(driven.device, driven.avatar, capture, options, [&](int done, int total) {
    progress(static_cast<double>(done) / total, fmt::format("picture {} of {}", done, total));
  });
  if (!run.is_finished) {
    for (const char* pictures : {"truth", "render", "sheets"}) fs::remove_all(output / pictures);
  }
  std::vector<std::string> cameras;
  for (const int camera : options.cameras) cameras.push_back(capture.camera_names()[static_cast<size_t>(camera)]);
  return {{{"metrics", summary.metrics},
           {"curve", FrameTable::read(output / "per_frame.csv").means(&few)},
           {"folder", fs::relative(output, setup.output).string()},
           {"command", commands(setup, evaluation, run, poses, cameras, output)}},
          std::round(static_cast<double>(driven.device.memory_statistics().peak_bytes_in_use) / (1 << 20))};
}

}  // namespace

std::unique_ptr<Capture> open_evaluation(const StudySetup& setup, const StudyEvaluation& evaluation) {
  CaptureOptions options = setup.capture;
  if (evaluation.name != "view") options.poses.clear();  // of the capture that is trained on
  options.codes = evaluation.codes;
  return open_capture(evaluation.data, options);
}

std::vector<int> evaluation_cameras(const StudySetup& setup, const StudyEvaluation& evaluation,
                                    const Capture& capture) {
  const std::vector<std::string>& names = capture.camera_names();
  if (evaluation.name == "view") return selected_cameras(setup.hold_out, names, "--hold-out");
  std::vector<std::string> present;
  for (const std::string& name : setup.hold_out) {
    if (std::find(names.begin(), names.end(), name) != names.end()) present.push_back(name);
  }
  if (present.empty() && evaluation.fits_poses) {
    throw Error::format(
        "--fit-poses: {} has none of the held-out cameras, so that poses would be fitted to the pictures that are "
        "measured; hold out a camera that it has, or leave --fit-poses away",
        evaluation.data.string());
  }
  return selected_cameras(present, names, "--hold-out");
}

std::vector<int> milestone_frames(int frame_count) {
  std::vector<int> frames;
  const int wanted = std::min(frame_count, 16);
  for (int i = 0; i < wanted; ++i) frames.push_back(i * frame_count / wanted);
  return frames;
}

RunEvaluations evaluate_run(const StudySetup& setup, const EvaluatedRun& run, const fs::path& folder,
                            const std::function<void(double, const std::string&)>& progress) {
  RunEvaluations found;
  std::vector<StudyEvaluation> list = setup.evaluations();
  if (!run.is_finished) std::erase_if(list, [](const StudyEvaluation& evaluation) { return evaluation.fits_poses; });
  for (size_t i = 0; i < list.size(); ++i) {
    const auto telling = [&](double begin, double end) {
      return [&progress, &list, i, begin, end](double part, const std::string& text) {
        const double done = static_cast<double>(i) + begin + (end - begin) * part;
        progress(done / static_cast<double>(list.size()), fmt::format("{}: {}", list[i].name, text));
      };
    };
    const fs::path output = folder / folder_name(list[i].name);
    const fs::path poses = list[i].fits_poses ? fs::path(output.string() + ".npz") : fs::path();
    const double fitting_share = list[i].fits_poses ? 0.8 : 0;
    if (list[i].fits_poses) fit_poses(setup, list[i], run, poses, telling(0, fitting_share));
    const Measurement measured = measure(setup, list[i], run, poses, output, telling(fitting_share, 1));
    found.by_name[list[i].name] = measured.found;
    found.memory_mib = std::max(found.memory_mib, measured.memory_mib);
  }
  return found;
}

}  // namespace degas
