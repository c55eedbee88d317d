#pragma once

#include "host/autograd/tensor.h"
#include "host/io/checkpoint.h"
#include "host/optim/optimiser.h"

namespace degas {

/// Copies parameters, moments and counters of an optimiser into a checkpoint. Waits for the device.
void store_optimiser(const Optimiser& optimiser, Checkpoint& checkpoint);
/// The way back. Throws Error naming the checkpoint's file and the array that does not fit.
void restore_optimiser(Optimiser& optimiser, const Checkpoint& checkpoint);
/// Replaces a tensor's values by the array of that name.
void restore_tensor(Tensor tensor, const std::string& name, const Checkpoint& checkpoint);

}  // namespace degas
