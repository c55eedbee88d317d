#pragma once

#include "model/study/study_runner.h"

namespace degas {

/// One variant with one seed, from where its folder is to its record.
class VariantRun {
 public:
  using Progress = std::function<void(double fraction, const std::string& text)>;

  VariantRun(const StudySetup& setup, const Variant& variant, int seed);

  /// record.json; null where the run has not been finished. Throws Error when it was made by another plan.
  nlohmann::json finished_record() const;
  /// Trains and evaluates what is left; null when it was stopped.
  nlohmann::json finish(const Progress& progress);

 private:
  nlohmann::json plan() const;
  /// Throws Error where plan.json holds another plan.
  void require_same_plan() const;
  /// By which anyone can train the same.
  std::string train_command() const;
  /// Up to a milestone; false when it was stopped.
  bool train_to(double fraction, const Progress& progress);
  /// Measures the checkpoint on every capture, into `folder`.
  nlohmann::json evaluate(const std::filesystem::path& folder, bool is_last, const Progress& progress);
  /// Of training, for budgets in steps, under which checkpoints hold no time.
  double minutes_by_history() const;

  const StudySetup& setup_;
  const Variant& variant_;
  int seed_;
  std::filesystem::path folder_, run_folder_;
  Config config_;
  nlohmann::json state_;  // times.json: what each milestone found, and figures of training
};

}  // namespace degas
