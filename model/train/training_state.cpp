#include "model/train/training_state.h"

#include <fmt/format.h>

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
constexpr int most_frames = 1 << 28, most_code_values = 1 << 16, most_updates = std::numeric_limits<int>::max();
constexpr double largest = std::numeric_limits<double>::max();

/// A number that lies where such numbers can; 'key' says in the error which it is.
template <typename T>
T number(const nlohmann::json& value, const char* key, T lowest, T highest, const std::string& file) {
  const bool is_of_type = std::is_integral_v<T> ? value.is_number_integer() : value.is_number();
  if (!is_of_type || !(value.get<double>() >= static_cast<double>(lowest)) ||
      !(value.get<double>() <= static_cast<double>(highest)))
    throw Error::format("{}: '{}' has {}, expected {} to {}; use an older copy", file, key, value.dump(), lowest,
                        highest);
  return value.get<T>();
}

template <typename T>
std::vector<T> numbers(const nlohmann::json& values, const char* key, T lowest, T highest, const std::string& file) {
  if (!values.is_array()) throw Error::format("{}: '{}' is no list of numbers; use an older copy", file, key);
  std::vector<T> result;
  for (const nlohmann::json& value : values) result.push_back(number<T>(value, key, lowest, highest, file));
  return result;
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
    state.step = number<int64_t>(header.at("step"), "step", 0, most_steps, file);
    state.config = parse_config(header.at("config").dump(), file);
    state.capture = header.at("capture");
    state.pictures = header.at("pictures");
    state.betas = numbers<double>(header.at("betas"), "betas", -largest, largest, file);
    state.face_code_size = number<int>(header.at("face_code_size"), "face_code_size", 0, most_code_values, file);
    state.refined_frames = numbers<int>(header.at("refined_frames"), "refined_frames", 0, most_frames, file);
    if (header.contains("minutes_spent"))
      state.minutes_spent = number<double>(header.at("minutes_spent"), "minutes_spent", 0, 1e9, file);
  } catch (const nlohmann::json::exception& error) {
    throw Error::format("{}: the header of this checkpoint is broken: {}; use an older copy", file, error.what());
  }
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
  // The first checkpoints name no rules: theirs is taken to be Adam's.
  std::vector<std::string> rules(parameters.size(), rule_name(UpdateRule::Adam));
  try {
    const nlohmann::json& saved = checkpoint.header.at("optimiser");
    const auto count = [&](const char* key) { return number<int>(saved.at(key), key, 0, most_updates, file); };
    progress.counters.applied = count("applied");
    progress.counters.skipped = count("skipped");
    progress.counters.skipped_in_a_row = count("skipped_in_a_row");
    // Checkpoints of before there was one lack it: it is then learnt anew.
    if (saved.contains("log_largest_norm"))
      progress.log_largest_norm =
          number<double>(saved.at("log_largest_norm"), "log_largest_norm", -largest, largest, file);
    progress.applied = numbers<int32_t>(saved.at("updates"), "updates", 0, most_updates, file);
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
