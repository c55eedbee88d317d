#include "host/device/tuner.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "host/device/user_cache.h"
#include "host/error.h"

namespace degas {
namespace {

using Clock = std::chrono::steady_clock;

/// Of the largest expected number: far above what another order of summation does, far below a wrong term.
constexpr double tolerance = 1e-4;
/// Less is noise.
constexpr double least_gain = 0.05;
/// A candidate this much slower than the best after a few looks is not looked at again.
constexpr double hopeless = 1.5;
constexpr int looks = 3;

struct Effort {
  size_t candidates;
  int rounds;
  double batch_milliseconds;  ///< short launches are repeated within a measurement
};

Effort effort_of(TuneMode mode) {
  return mode == TuneMode::Full ? Effort{1000, 15, 2} : Effort{6, 8, 1};
}

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

void say(const std::string& name, const Parameters& parameters, const std::string& text) {
  fmt::print(stderr, "tuner: {} with {}: {}\n", name, to_string(parameters), text.substr(0, text.find('\n')));
}

/// Largest absolute number, and largest difference; infinite where one is no number.
std::pair<double, double> largest_and_difference(const std::vector<double>& expected, const std::vector<double>& got) {
  double largest = 0, difference = 0;
  for (size_t i = 0; i < expected.size(); ++i) {
    largest = std::max(largest, std::abs(expected[i]));
    const double here = std::abs(got[i] - expected[i]);
    if (!(here <= difference)) difference = std::isnan(here) ? INFINITY : here;
  }
  return {largest, difference};
}

}  // namespace

Tuner::Tuner(Device& device, TuneMode mode, const std::filesystem::path& cache)
    : device_(device), mode_(mode), cache_(cache) {}

Parameters Tuner::choose(const TunedKernel& kernel, const std::string& shape,
                         const std::function<Tunable()>& describe) {
  const std::string name = kernel.name + ' ' + shape;
  if (const auto found = chosen_.find(name); found != chosen_.end()) return found->second;
  const TuningKey key = key_of(kernel, shape);
  const Tunable tunable = describe();
  std::optional<TuningChoice> choice = known(key, tunable.candidates);
  if (choice) {
    ++known_;
  } else if ((choice = tune(name, tunable))) {
    cache_.add(key, *choice);
  } else {
    choice = {tunable.candidates.front(), mode_};
  }
  if (record_ && !record_->find(key) && !record_->add(key, *choice)) {
    throw Error::format("{}: cannot be written; is the disk full?", record_->file().string());
  }
  return chosen_[name] = choice->parameters;
}

TuningKey Tuner::key_of(const TunedKernel& kernel, const std::string& shape) {
  std::string& source = sources_[kernel.name];
  if (source.empty()) {
    std::string text;
    for (const std::string& file : kernel.files) text += device_.kernel_text(file);
    source = content_hash(text);
  }
  const DeviceDescription& d = device_.description();
  const std::string variant =
      fmt::format("{} {} ", device_.is_wide() ? "wide" : "gpu", device_.real_bytes() == 8 ? "double" : "float");
  return {d.name, d.platform + ' ' + d.version + ' ' + d.driver, kernel.name, variant + shape, source};
}

std::optional<TuningChoice> Tuner::known(const TuningKey& key, const std::vector<Parameters>& candidates) const {
  const auto legal = [&](const std::optional<TuningChoice>& choice) {
    return choice && std::find(candidates.begin(), candidates.end(), choice->parameters) != candidates.end();
  };
  if (record_) {
    if (const auto recorded = record_->find(key); legal(recorded)) return recorded;
  }
  const auto cached = cache_.find(key);
  const bool hard_enough = cached && (mode_ == TuneMode::Fast || cached->mode == TuneMode::Full);
  return hard_enough && legal(cached) ? cached : std::nullopt;
}

std::vector<double> Tuner::numbers_of(const Trial& trial, const Parameters& parameters) {
  const auto download = [&](auto real) {
    std::vector<decltype(real)> numbers(trial.output_count);
    device_.download(*trial.output, numbers.data(), numbers.size() * sizeof(real));
    return std::vector<double>(numbers.begin(), numbers.end());
  };
  // NaNs stand where a launch does not write.
  device_.fill(*trial.output, 0xFF, trial.output_count * device_.real_bytes());
  trial.launch(parameters);
  return device_.real_bytes() == sizeof(double) ? download(double()) : download(float());
}

double Tuner::measure(const Trial& trial, const Parameters& parameters, int runs) {
  device_.finish();
  const Clock::time_point start = Clock::now();
  for (int run = 0; run < runs; ++run) trial.launch(parameters);
  device_.finish();
  return milliseconds_since(start) / runs;
}

std::vector<Tuner::Candidate> Tuner::verified(const std::string& name, const Tunable& tunable, const Trial& trial) {
  const Effort effort = effort_of(mode_);
  std::vector<Candidate> result;
  std::vector<double> expected;
  for (const Parameters& parameters : tunable.candidates) {
    if (result.size() == effort.candidates) break;
    try {
      const std::vector<double> got = numbers_of(trial, parameters);
      if (result.empty()) expected = got;
      if (const auto [largest, difference] = largest_and_difference(expected, got); difference > tolerance * largest) {
        if (result.empty()) throw Error("the default's own numbers are not finite");
        say(name, parameters,
            fmt::format("differs from the default by {:.2g}, numbers up to {:.2g}; left out", difference, largest));
        continue;
      }
      const double estimate = measure(trial, parameters, 1);
      const double runs = std::clamp(effort.batch_milliseconds / std::max(estimate, 1e-3), 1.0, 200.0);
      result.push_back({&parameters, estimate, static_cast<int>(runs)});
    } catch (const std::exception& error) {
      if (result.empty()) throw;
      say(name, parameters, fmt::format("{}; left out", error.what()));
    }
  }
  return result;
}

std::optional<TuningChoice> Tuner::tune(const std::string& name, const Tunable& tunable) {
  const Clock::time_point start = Clock::now();
  std::vector<Candidate> rivals;
  try {
    const Trial trial = tunable.prepare();
    rivals = verified(name, tunable, trial);
    // In turns, so that what else the machine does meets all alike; of the best times, since company only adds.
    for (int round = 0; round < effort_of(mode_).rounds; ++round) {
      double best = INFINITY;
      for (Candidate& rival : rivals) {
        rival.milliseconds = std::min(rival.milliseconds, measure(trial, *rival.parameters, rival.runs));
        best = std::min(best, rival.milliseconds);
      }
      if (round + 1 != looks) continue;
      std::erase_if(rivals, [&](const Candidate& rival) {
        return &rival != rivals.data() && rival.milliseconds > hopeless * best;
      });
    }
  } catch (const Error& error) {
    say(name, tunable.candidates.front(), fmt::format("{}; not tuned", error.what()));
    return std::nullopt;
  }
  const Candidate& usual = rivals.front();
  const Candidate& fastest = *std::min_element(
      rivals.begin(), rivals.end(), [](const auto& a, const auto& b) { return a.milliseconds < b.milliseconds; });
  const Candidate& winner = fastest.milliseconds < (1 - least_gain) * usual.milliseconds ? fastest : usual;
  ++tuned_;
  seconds_ += milliseconds_since(start) * 1e-3;
  milliseconds_ += winner.milliseconds;
  default_milliseconds_ += usual.milliseconds;
  return TuningChoice{*winner.parameters, mode_, winner.milliseconds, usual.milliseconds};
}

std::string Tuner::summary() const {
  if (tuned_ + known_ == 0) return {};
  return fmt::format("{} launches tuned in {:.1f} s: {:.2f} ms in all instead of {:.2f}; {} known already", tuned_,
                     seconds_, milliseconds_, default_milliseconds_, known_);
}

void set_tuner(Device& device, TuneMode mode) {
  if (mode == TuneMode::Off) return;
  device.set_tuner(std::make_unique<Tuner>(device, mode, cache_folder() / "tuning.json"));
}

}  // namespace degas
