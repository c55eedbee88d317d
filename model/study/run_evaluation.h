#pragma once

#include <memory>

#include "model/study/study_runner.h"

namespace degas {

/// A capture to measure on, at the setup's scale.
std::unique_ptr<Capture> open_evaluation(const StudySetup& setup, const StudyEvaluation& evaluation);
/// The held-out cameras; of a novel sequence those that it has, or all where it has none of them. Error where poses
/// would be fitted to what is measured.
std::vector<int> evaluation_cameras(const StudySetup& setup, const StudyEvaluation& evaluation, const Capture& capture);
/// The frames of evaluations before the last milestone: at most sixteen, evenly spaced. The last milestone's means of
/// these stand beside them.
std::vector<int> milestone_frames(int frame_count);

/// A training run as an evaluation needs to know it.
struct EvaluatedRun {
  std::filesystem::path folder;
  std::string pictures;     ///< picture_identity of the capture that it was trained on
  bool is_finished = true;  ///< else few frames are measured, none with fitted poses, and no pictures are kept
};

struct RunEvaluations {
  nlohmann::json by_name;  ///< of each StudyEvaluation: metrics, curve (means of the milestone frames), folder, command
  double memory_mib = 0;   ///< the largest peak
};

/// Measures a run's checkpoint on every capture of the study, into `folder`. progress: told the share that is done.
/// Throws Error when it is stopped.
RunEvaluations evaluate_run(const StudySetup& setup, const EvaluatedRun& run, const std::filesystem::path& folder,
                            const std::function<void(double share, const std::string& text)>& progress);

}  // namespace degas
