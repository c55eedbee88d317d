#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/device/device.h"
#include "host/device/tuning_table.h"

namespace degas {

/// What is tuned: a name, and the files of kernels/ that it runs, whose text the choice belongs to.
struct TunedKernel {
  std::string name;
  std::vector<std::string> files;
};

/// A launch on invented numbers, for candidates to be tried on.
struct Trial {
  const Memory* output;  ///< what `launch` writes in full; `launch` keeps it
  int64_t output_count;  ///< REALs in it
  std::function<void(const Parameters&)> launch;
};

/// What may be tried for a launch.
struct Tunable {
  /// Every legal one, the default first, then the likelier ones first. Each gives the same numbers up to rounding.
  std::vector<Parameters> candidates;
  std::function<Trial()> prepare;
};

/// Finds the fastest parameters of a launch when its kernel and shape are met for the first time, and keeps them: for
/// the process, in the user's cache (TuningTable in cache_folder()/tuning.json) and, with record_in(), in a training
/// run. What a record or the cache knows is not tried again, so equal tables give equal bits. A candidate is timed only
/// when its numbers are the default's up to rounding; one that is not, or that the device refuses, is left out with a
/// line on standard error. The default stays unless another is at least 5 % faster.
class Tuner {
 public:
  /// mode: Fast or Full. cache: file of the user's table.
  Tuner(Device& device, TuneMode mode, const std::filesystem::path& cache);
  virtual ~Tuner() = default;

  /// Choices come from this file where it has them, and every choice made is added to it.
  void record_in(const std::filesystem::path& file) { record_.emplace(file); }
  /// The parameters for a launch of `kernel`. shape: all that the best choice depends on
  /// besides the device; every launch of one shape has the same candidates. Virtual so that tests may choose.
  virtual Parameters choose(const TunedKernel& kernel, const std::string& shape,
                            const std::function<Tunable()>& describe);
  /// "31 launches tuned in 4.2 s: 11.0 -> 9.8 ms in all; 12 known"; empty when nothing was asked for.
  std::string summary() const;

 protected:
  /// Milliseconds of a launch, mean of so many. Virtual so that tests need no clock.
  virtual double measure(const Trial& trial, const Parameters& parameters, int runs);

 private:
  struct Candidate {
    const Parameters* parameters;
    double milliseconds;
    int runs;  ///< in one measurement
  };
  TuningKey key_of(const TunedKernel& kernel, const std::string& shape);
  std::optional<TuningChoice> known(const TuningKey& key, const std::vector<Parameters>& candidates) const;
  /// Nothing when the default itself cannot be tried: no room for the trial's arrays, say.
  std::optional<TuningChoice> tune(const std::string& name, const Tunable& tunable);
  /// The candidates that give the default's numbers, the default first, with a first impression of their times.
  std::vector<Candidate> verified(const std::string& name, const Tunable& tunable, const Trial& trial);
  std::vector<double> numbers_of(const Trial& trial, const Parameters& parameters);

  Device& device_;
  TuneMode mode_;
  TuningTable cache_;
  std::optional<TuningTable> record_;
  std::map<std::string, Parameters> chosen_;    // by kernel and shape
  std::map<std::string, std::string> sources_;  // hashes by kernel
  int tuned_ = 0, known_ = 0;
  double seconds_ = 0, milliseconds_ = 0, default_milliseconds_ = 0;
};

/// Gives the device a tuner with the user's cache, unless the mode is Off.
void set_tuner(Device& device, TuneMode mode);

}  // namespace degas
