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

/// One capture's share of a run's evaluation, on a device and an avatar of its own.
class CaptureEvaluation {
 public:
  CaptureEvaluation(const StudySetup& setup, const StudyEvaluation& evaluation, const EvaluatedRun& run,
                    const fs::path& folder)
      : setup_(setup),
        evaluation_(evaluation),
        run_(run),
        output_(folder / folder_name(evaluation.name)),
        poses_(folder / (folder_name(evaluation.name) + ".npz")),
        device_(setup.device),
        avatar_(device_, RunFolder(run.folder)) {
    set_tuner(device_, setup.tune);
  }

  /// Into poses_, for the frames that will be measured.
  void fit_poses(const Progress& progress) {
    const auto capture = open({});
    PoseFitOptions options;
    options.cameras = avatar_.cameras_not_held_out(*capture);
    FittedPoses poses(poses_, avatar_, *capture, options);
    PoseFitter fitter(device_, avatar_, *capture, options);
    const std::vector<int> frames = selected_frames({}, capture->frame_count(), "--frames");
    const bool is_whole = fit_frames(fitter, poses, frames, setup_.stop_requested, [&](int done, const FittedPose&) {
      progress(static_cast<double>(done) / static_cast<double>(frames.size()),
               fmt::format("fitting frame {} of {}", done, frames.size()));
    });
    if (!is_whole) throw Error("interrupted while poses were fitted");
  }

  json measure(const Progress& progress) {
    const auto capture = open(evaluation_.fits_poses ? poses_ : fs::path());
    EvaluationOptions options;
    options.cameras = evaluation_cameras(setup_, evaluation_, *capture);
    const std::vector<int> few = milestone_frames(capture->frame_count());
    options.frames = run_.is_finished ? selected_frames({}, capture->frame_count(), "--frames") : few;
    options.output = output_;
    options.networks = setup_.networks(device_, avatar_.config().loss);
    options.stop_requested = setup_.stop_requested;
    const EvaluationSummary summary = evaluate(device_, avatar_, *capture, options, [&](int done, int total) {
      progress(static_cast<double>(done) / total, fmt::format("picture {} of {}", done, total));
    });
    if (!run_.is_finished) {
      for (const char* pictures : {"truth", "render", "sheets"}) fs::remove_all(output_ / pictures);
    }
    std::vector<std::string> cameras;
    for (const int camera : options.cameras) cameras.push_back(capture->camera_names()[static_cast<size_t>(camera)]);
    return {{"metrics", summary.metrics},
            {"curve", FrameTable::read(output_ / "per_frame.csv").means(&few)},
            {"folder", fs::relative(output_, setup_.output).string()},
            {"command", commands(cameras)}};
  }

  double peak_memory_mib() const {
    return std::round(static_cast<double>(device_.memory_statistics().peak_bytes_in_use) / (1 << 20));
  }

 private:
  /// As training knew it, but for what `poses` says.
  std::unique_ptr<Capture> open(const fs::path& poses) const {
    std::unique_ptr<Capture> capture = open_evaluation(setup_, evaluation_);
    if (evaluation_.name == "view") capture = std::make_unique<SameRecording>(std::move(capture), run_.pictures);
    capture = avatar_.as_registered(std::move(capture));
    return poses.empty() ? std::move(capture) : with_registration(std::move(capture), poses);
  }

  /// By which anyone can measure the same.
  std::string commands(const std::vector<std::string>& cameras) const {
    std::vector<std::string> words = {"--run", run_.folder.string(), "--data", evaluation_.data.string()};
    const auto add = [](std::vector<std::string>& words, const std::vector<std::string>& more) {
      words.insert(words.end(), more.begin(), more.end());
    };
    if (!evaluation_.codes.empty()) add(words, {"--codes", evaluation_.codes.string()});
    add(words, shared_words(setup_));
    std::vector<std::string> eval = {"eval"}, fit = {"fit-poses"};
    add(eval, words);
    add(eval, setup_.metrics);
    if (evaluation_.name == "view" && !setup_.capture.poses.empty())
      add(eval, {"--poses", setup_.capture.poses.string()});
    if (evaluation_.fits_poses) add(eval, {"--poses", poses_.string()});
    add(eval, {"--cameras", fmt::format("{}", fmt::join(cameras, ",")), "--out", output_.string()});
    if (!evaluation_.fits_poses) return command_text(eval);
    add(fit, words);
    add(fit, {"--out", poses_.string()});
    return command_text(fit) + " && " + command_text(eval);
  }

  const StudySetup& setup_;
  const StudyEvaluation& evaluation_;
  const EvaluatedRun& run_;
  fs::path output_, poses_;
  Device device_;
  TrainedAvatar avatar_;
};

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
    CaptureEvaluation evaluation(setup, list[i], run, folder);
    const auto telling = [&](double begin, double end) {
      return [&progress, &list, i, begin, end](double part, const std::string& text) {
        const double done = static_cast<double>(i) + begin + (end - begin) * part;
        progress(done / static_cast<double>(list.size()), fmt::format("{}: {}", list[i].name, text));
      };
    };
    constexpr double fitting_share = 0.8;
    const double measured_from = list[i].fits_poses ? fitting_share : 0;
    if (list[i].fits_poses) evaluation.fit_poses(telling(0, fitting_share));
    found.by_name[list[i].name] = evaluation.measure(telling(measured_from, 1));
    found.memory_mib = std::max(found.memory_mib, evaluation.peak_memory_mib());
  }
  return found;
}

}  // namespace degas
