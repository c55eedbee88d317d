#include "model/train/training_state.h"

#include "host/error.h"

namespace degas {

void restore_tensor(Tensor tensor, const std::string& name, const Checkpoint& checkpoint) {
  tensor.upload(std::span<const float>(checkpoint.array(name, static_cast<size_t>(tensor.size()))));
}

void store_optimiser(const Optimiser& optimiser, Checkpoint& checkpoint) {
  const Optimiser::Progress progress = optimiser.progress();
  checkpoint.header["optimiser"] = {{"applied", progress.counters.applied},
                                    {"skipped", progress.counters.skipped},
                                    {"skipped_in_a_row", progress.counters.skipped_in_a_row},
                                    {"log_largest_norm", *progress.log_largest_norm},
                                    {"updates", progress.applied}};
  for (const Optimiser::Parameter& parameter : optimiser.parameters()) {
    checkpoint.arrays.emplace_back(parameter.name, parameter.value.to_host<float>());
    checkpoint.arrays.emplace_back(parameter.name + ".first_moment", parameter.first_moment.to_host<float>());
    checkpoint.arrays.emplace_back(parameter.name + ".second_moment", parameter.second_moment.to_host<float>());
  }
}

void restore_optimiser(Optimiser& optimiser, const Checkpoint& checkpoint) {
  Optimiser::Progress progress;
  try {
    const nlohmann::json& saved = checkpoint.header.at("optimiser");
    progress.counters.applied = saved.at("applied");
    progress.counters.skipped = saved.at("skipped");
    progress.counters.skipped_in_a_row = saved.at("skipped_in_a_row");
    // Checkpoints of before there was one lack it: it is then learnt anew.
    if (saved.contains("log_largest_norm")) progress.log_largest_norm = saved.at("log_largest_norm").get<double>();
    progress.applied = saved.at("updates").get<std::vector<int32_t>>();
  } catch (const nlohmann::json::exception& error) {
    throw Error::format("{}: the optimiser's counters are missing or broken: {}", checkpoint.file.string(),
                        error.what());
  }
  for (const Optimiser::Parameter& parameter : optimiser.parameters()) {
    restore_tensor(parameter.value, parameter.name, checkpoint);
    restore_tensor(parameter.first_moment, parameter.name + ".first_moment", checkpoint);
    restore_tensor(parameter.second_moment, parameter.name + ".second_moment", checkpoint);
  }
  optimiser.restore(progress);
}

}  // namespace degas
