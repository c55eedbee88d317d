#include "model/train/training_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <type_traits>

#include "host/error.h"
#include "model/data/capture.h"

namespace degas {

namespace {

const char* rule_name(UpdateRule rule) {
  switch (rule) {
    case UpdateRule::Adam:
      return "adam";
    case UpdateRule::Rprop:
      return "rprop";
  }
  throw std::logic_error("rule_name: no such rule");
}

constexpr int64_t most_steps = int64_t{1} << 40;
constexpr int most_frames = 1 << 28, most_code_values = 1 << 16;

/// A number that lies where such numbers can.
template <typename T>
T number(const nlohmann::json& header, const char* key, T lowest, T highest, const std::string& file) {
  const nlohmann::json& value = header.at(key);
  const bool is_of_type = std::is_integral_v<T> ? value.is_number_integer() : value.is_number();
  if (!is_of_type || !(value.get<double>() >= static_cast<double>(lowest)) ||
      !(value.get<double>() <= static_cast<double>(highest)))
    throw Error::format("{}: '{}' is {}, expected {} to {}; use an older copy", file, key, value.dump(), lowest,
                        highest);
  return value.get<T>();
}

}  // namespace

void store_state(const RunState& state, Checkpoint& checkpoint) {
  checkpoint.header["step"] = state.step;
  checkpoint.header["config"] = nlohmann::json::parse(config_text(state.config));
  checkpoint.header["capture"] = state.capture;
  checkpoint.header["pictures"] = state.pictures;
  checkpoint.header["betas"] = state.betas;
  checkpoint.header["face_code_size"] = state.face_code_size;
  checkpoint.header["refined_frames"] = state.refined_frames;
  if (state.minutes_spent > 0) checkpoint.header["minutes_spent"] = state.minutes_spent;
}

RunState read_state(const Checkpoint& checkpoint) {
  const std::string file = checkpoint.file.string();
  const nlohmann::json& header = checkpoint.header;
  RunState state;
  try {
    state.step = number<int64_t>(header, "step", 0, most_steps, file);
    state.config = parse_config(header.at("config").dump(), file);
    state.capture = header.at("capture");
    state.pictures = header.at("pictures");
    state.betas = header.at("betas").get<std::vector<double>>();
    state.face_code_size = number<int>(header, "face_code_size", 0, most_code_values, file);
    for (const nlohmann::json& frame : header.at("refined_frames")) {
      if (!frame.is_number_integer())
        throw Error::format("{}: 'refined_frames' has {}; use an older copy", file, frame.dump());
      state.refined_frames.push_back(frame.get<int>());
    }
    if (header.contains("minutes_spent")) state.minutes_spent = number<double>(header, "minutes_spent", 0, 1e9, file);
  } catch (const nlohmann::json::exception& error) {
    throw Error::format("{}: the header of this checkpoint is broken: {}; use an older copy", file, error.what());
  }
  for (const int frame : state.refined_frames) {
    if (frame < 0 || frame > most_frames)
      throw Error::format("{}: 'refined_frames' has {}, expected 0 to {}; use an older copy", file, frame, most_frames);
  }
  if (!std::all_of(state.betas.begin(), state.betas.end(), [](double value) { return std::isfinite(value); }))
    throw Error::format("{}: 'betas' holds a number that is not finite; use an older copy", file);
  return state;
}

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
  nlohmann::json& rules = checkpoint.header["optimiser"]["rules"];
  for (const Optimiser::Parameter& parameter : optimiser.parameters()) {
    rules.push_back(rule_name(parameter.rule));
    checkpoint.arrays.emplace_back(parameter.name, parameter.value.to_host<float>());
    checkpoint.arrays.emplace_back(parameter.name + ".first_moment", parameter.first_moment.to_host<float>());
    checkpoint.arrays.emplace_back(parameter.name + ".second_moment", parameter.second_moment.to_host<float>());
  }
}

void restore_optimiser(Optimiser& optimiser, const Checkpoint& checkpoint) {
  const std::string file = checkpoint.file.string();
  const std::vector<Optimiser::Parameter>& parameters = optimiser.parameters();
  Optimiser::Progress progress;
  // The first checkpoints name no rules; in most of them all was Adam's.
  std::vector<std::string> rules(parameters.size(), rule_name(UpdateRule::Adam));
  try {
    const nlohmann::json& saved = checkpoint.header.at("optimiser");
    constexpr int most = std::numeric_limits<int>::max();
    progress.counters.applied = number<int>(saved, "applied", 0, most, file);
    progress.counters.skipped = number<int>(saved, "skipped", 0, most, file);
    progress.counters.skipped_in_a_row = number<int>(saved, "skipped_in_a_row", 0, most, file);
    // Checkpoints of before there was one lack it: it is then learnt anew.
    if (saved.contains("log_largest_norm")) progress.log_largest_norm = saved.at("log_largest_norm").get<double>();
    progress.applied = saved.at("updates").get<std::vector<int32_t>>();
    if (saved.contains("rules")) rules = saved.at("rules").get<std::vector<std::string>>();
  } catch (const nlohmann::json::exception& error) {
    throw Error::format("{}: the optimiser's counters are missing or broken: {}; use an older copy", file,
                        error.what());
  }
  if (progress.applied.size() != parameters.size() || rules.size() != parameters.size()) {
    throw Error::format(
        "{}: its optimiser has {} parameters with {} rules, this configuration's has {}; resume with the "
        "config and the degas that it was made with",
        file, progress.applied.size(), rules.size(), parameters.size());
  }
  if (std::any_of(progress.applied.begin(), progress.applied.end(), [](int32_t updates) { return updates < 0; }))
    throw Error::format("{}: a parameter was updated a negative number of times; use an older copy", file);

  int left = 0;
  for (size_t i = 0; i < parameters.size(); ++i) {
    Tensor first = parameters[i].first_moment, second = parameters[i].second_moment;
    restore_tensor(parameters[i].value, parameters[i].name, checkpoint);
    if (rules[i] == rule_name(parameters[i].rule)) {
      restore_tensor(first, parameters[i].name + ".first_moment", checkpoint);
      restore_tensor(second, parameters[i].name + ".second_moment", checkpoint);
    } else {
      // One rule's moments mean nothing to another.
      first.fill_zero();
      second.fill_zero();
      progress.applied[i] = 0;
      ++left;
    }
  }
  optimiser.restore(progress);
  if (left > 0) {
    print_warning(
        fmt::format("{}: does not say that {} of its parameters were updated by today's rule: training goes on "
                    "from their values alone",
                    file, left));
  }
}

}  // namespace degas
