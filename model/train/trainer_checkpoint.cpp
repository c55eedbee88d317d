// What a Trainer saves, and how it goes on from it.
#include <fmt/ranges.h>

#include "host/error.h"
#include "model/train/trainer.h"
#include "model/train/training_state.h"

namespace degas {

void Trainer::save() const {
  std::vector<int> refined_frames;
  for (const auto& [frame, correction] : corrections_) refined_frames.push_back(frame);
  Checkpoint checkpoint;
  store_state({step_, config_, capture_.identity(), capture_.picture_identity(), avatar_.betas(), codes_.size(),
               refined_frames, minutes_spent_},
              checkpoint);
  store_optimiser(optimiser_, checkpoint);
  run_.save(checkpoint);
}

void Trainer::save_unless_broken() const {
  if (optimiser_.counters().skipped_in_a_row == 0 || !run_.has_checkpoint() || non_finite_parameter().empty()) save();
}

void Trainer::resume() {
  const Checkpoint checkpoint = run_.checkpoint_to_resume();
  const std::string file = checkpoint.file.string();
  const RunState state = read_state(checkpoint);
  Config saved = state.config;
  // How long to train, how often to tell and what helps a run that went astray may change from call to call; everything
  // else makes another run of it.
  saved.description = config_.description;
  saved.train.iterations = config_.train.iterations;
  saved.train.log_every = config_.train.log_every;
  saved.train.validation_every = config_.train.validation_every;
  saved.train.checkpoint_every = config_.train.checkpoint_every;
  if (!config_.train.refine_poses) saved.train.pose_learning_rate = config_.train.pose_learning_rate;  // says nothing
  const Config before = saved;
  saved.train.learning_rate = config_.train.learning_rate;
  saved.train.spike_limit = config_.train.spike_limit;
  saved.train.max_skipped_steps = config_.train.max_skipped_steps;
  const std::vector<std::string> changes = config_differences(before, saved);
  if (const std::vector<std::string> differences = config_differences(saved, config_); !differences.empty()) {
    throw Error::format(
        "{}: was trained with another configuration: {}; resume with the run's config.json as --config, or name "
        "another --out",
        file, fmt::join(differences, ", "));
  }
  if (state.capture != capture_.identity()) {
    throw Error::format("{}: was trained on another capture, or its files or --poses changed; give the same again, or another --out",
                        file);
  }
  for (const std::string& change : changes) print_warning("going on with another " + change);
  restore_optimiser(optimiser_, checkpoint);
  told_skip_ = -1;
  step_ = state.step;
  minutes_spent_ = state.minutes_spent;
  run_.remove_leftovers();
  run_.truncate_history(step_);
  run_.write_config(config_);
}

}  // namespace degas
