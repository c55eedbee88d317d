#pragma once

#include <functional>
#include <map>
#include <optional>

#include "host/optim/optimiser.h"
#include "model/config.h"
#include "model/data/capture.h"
#include "model/loss/loss.h"
#include "model/train/pose_correction.h"
#include "model/train/prepared_step.h"
#include "model/train/run_folder.h"
#include "model/train/training_budget.h"
#include "model/train/training_report.h"
#include "model/train/view_schedule.h"

namespace degas {

enum class TrainingEnd { Finished, OutOfTime, Interrupted };

/// Trains one avatar on one capture. A step decodes one frame, draws it in train.views_per_step cameras, and updates.
/// Same seed, same device: the same bits, over interruptions too when the budget is in iterations.
class Trainer {
 public:
  /// body: read from the run folder. Throws Error when the capture, body and config do not fit together.
  Trainer(Device& device, const Config& config, const Capture& capture, const RunFolder& run);

  /// Continues from the run's checkpoint. Its length and reporting intervals may differ, and, which is warned of, what
  /// the Error of skipped steps advises to change. Throws Error when it is of another configuration or capture.
  void resume();
  /// Trains until the budget is spent; saves at the end, at Ctrl-C and every train.checkpoint_every steps. Throws Error
  /// after train.max_skipped_steps skipped steps in a row; the last good checkpoint then stands.
  TrainingEnd run(const TrainingBudget& budget, const std::function<void(const TrainingReport&)>& report);

  int64_t step() const { return step_; }
  /// Of all, resumed ones included. Waits for the device.
  int skipped_steps() const { return optimiser_.counters().skipped; }
  /// Of training so far, resumed ones included, under a budget in minutes; 0 under one in steps.
  double minutes_spent() const { return minutes_spent_; }
  const Avatar& avatar() const { return avatar_; }

 private:
  struct Step {
    LossTerms terms;
    Tensor opacities, log_scales;  // of the canonical Gaussians
  };
  Step train_step(const LoadedStep& loaded, double fraction);
  /// Up to the loss. What only the tape still needs is held by it alone, so that it goes back to the pool on the way.
  Step forward(Tape& tape, const LoadedStep& loaded);
  Splats posed_splats(Tape& tape, const Avatar::Signal& signal, const CanonicalGaussians& gaussians, int frame) const;
  std::vector<SplatImage> draw(Tape& tape, const Splats& splats, const std::vector<TrainingPicture>& pictures);
  double learning_rate_factor(double fraction) const;
  double validation_psnr();
  /// Why the last skipped step was skipped (skip_text), by drawing it once more. Empty where none was skipped since the
  /// last call.
  std::string skip_cause(const Optimiser::Counters& counters);
  /// The first parameter that holds a number that is not finite; empty where none does.
  std::string non_finite_parameter() const;
  /// Throws the Error of steps that fail in a row.
  void require_progress(const Optimiser::Counters& counters);
  TrainingReport make_report(const Step& step, const Optimiser::Counters& counters, double fraction);
  void save() const;
  /// Parameters that went wrong do not take the place of a good checkpoint.
  void save_unless_broken() const;

  Device& device_;
  Config config_;
  const Capture& capture_;
  RunFolder run_;
  Avatar avatar_;
  TrainingViews views_;
  ViewSchedule schedule_;
  FaceCodes codes_;             // used by the loader's thread while a run lasts
  FaceCodes validation_codes_;  // used by this thread
  StepPreparer preparer_;
  Loss loss_;
  Optimiser optimiser_;
  SplatWorkspace workspace_;
  std::map<int, PoseCorrection> corrections_;
  int64_t step_ = 0;
  int told_skip_ = -1;        // Optimiser::Counters::Skipped::step
  double minutes_spent_ = 0;  // under budgets in minutes
};

}  // namespace degas
