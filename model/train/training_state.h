#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/autograd/tensor.h"
#include "host/io/checkpoint.h"
#include "host/optim/optimiser.h"
#include "model/config.h"

namespace degas {

/// What a checkpoint says of its run, beside the optimiser's state.
struct RunState {
  int64_t step = 0;
  Config config;
  std::string capture, pictures;  ///< Capture::identity() and picture_identity()
  std::vector<double> betas;
  int face_code_size = 0;
  std::vector<int> refined_frames;
  double minutes_spent = 0;  ///< 0 where steps are the budget: a checkpoint's bytes then depend on the steps alone
};

void store_state(const RunState& state, Checkpoint& checkpoint);
/// The way back. Throws Error naming the checkpoint's file, and the key that is missing or has a value that none can
/// have.
RunState read_state(const Checkpoint& checkpoint);

/// Copies parameters, moments and counters of an optimiser into a checkpoint. Waits for the device.
void store_optimiser(const Optimiser& optimiser, Checkpoint& checkpoint);
/// The way back. A parameter that the checkpoint's optimiser updated by another rule gets its value alone, with a
/// warning. Throws Error naming the checkpoint's file and the array or counter that does not fit.
void restore_optimiser(Optimiser& optimiser, const Checkpoint& checkpoint);
/// Replaces a tensor's values by the array of that name.
void restore_tensor(Tensor tensor, const std::string& name, const Checkpoint& checkpoint);

}  // namespace degas
