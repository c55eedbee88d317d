#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/autograd/tape.h"
#include "host/device/tuning_table.h"

namespace degas::bench {

/// Milliseconds of one run.
struct Timing {
  double best = 0, median = 0;
  double spread = 0;  ///< (third quartile - first) / median
};

/// Wall: what a user waits. Cpu: the process's processor time divided by the cores, for a machine that others use too;
/// a peer whose threads spin while they wait is charged for it.
enum class Clock { Wall, Cpu };

struct MeasureOptions {
  int repetitions = 7;
  double batch_milliseconds = 10;  ///< short work is repeated within a measurement until it takes about this long
  Clock clock = Clock::Wall;
};

/// Milliseconds since some moment; differences count.
double now(Clock clock);
/// Of one measurement each, at least one.
Timing timing_of(std::vector<double> milliseconds);

/// Times `work` after two warm-up runs; `wait` is called before each reading of the clock (device.finish()).
Timing measure(const std::function<void()>& work, const std::function<void()>& wait,
               const MeasureOptions& options = {});

/// What a device can do at most: shares are told against it.
struct Peaks {
  double gflops = 0;                ///< fused multiply-adds on registers
  double gigabytes_per_second = 0;  ///< a copy of 128 MiB, bytes read and written
};
Peaks measure_peaks(Device& device, Clock clock = Clock::Wall);

/// Command line of every benchmark: [--json FILE] [--device SELECTOR] [--filter TEXT] [--clock wall|cpu], and
/// [--tune fast|full] for those that show what tuning gains; prints help and exits on others.
struct Arguments {
  std::string json, device, filter;
  TuneMode tune = TuneMode::Off;
  Clock clock = Clock::Wall;

  DeviceOptions device_options() const;
  /// Whether --filter leaves a row or case of this name in.
  bool wants(const std::string& name) const { return name.find(filter) != std::string::npos; }
};
Arguments parse_arguments(int count, char** values);

/// One measured piece of work beside its peer, if it has one.
struct Row {
  std::string name;
  Timing time;
  double gflop = 0;      ///< 10^9 operations in a run; 0: not counted
  double gigabytes = 0;  ///< 10^9 bytes that a run must read and write at least, each once; 0: not counted
  std::optional<Timing> peer_time;
  std::string peer;
  std::string kind = {};  ///< rows of one kind get a mean ratio of their own; empty: none
  std::vector<std::pair<std::string, double>> details = {};  ///< further numbers by name, printed behind the row
};

/// Prints a table as rows come in; finish() prints the totals and writes the JSON file {"results": [{"name", "ms",
/// "best_ms", "spread", "gflops", "gigabytes_per_second", "share_of_peak", "peer", "peer_ms", "peer_best_ms", "ratio",
/// details}], "geomean_ratio", "geomean_ratios" by kind, "peak_gflops", "peak_gigabytes_per_second", "load_average",
/// "busy"}. share_of_peak is that of the nearer roof, arithmetic or memory; data that is in a cache already may pass
/// the latter. ratio = peer_best_ms / best_ms, above 1 we are faster; of the best times, since company on the machine
/// only ever adds to them. busy: others had the machine at the start, so that no figure is to be quoted; it is printed
/// too.
class Report {
 public:
  /// No shares of a peak that is 0.
  Report(const std::string& title, const Peaks& peaks);
  void add(const Row& row);
  void finish(const std::string& json_file) const;

 private:
  double share_of_peak(const Row& row) const;

  Peaks peaks_;
  double load_average_;
  bool busy_;
  std::vector<Row> rows_;
};

/// What a benchmark of operators opens with: its command line, the device that this names, and a report with the peaks
/// of that device.
struct Bench {
  /// subject: what is measured, for the title.
  Bench(int count, char** values, const std::string& subject);

  const Arguments arguments;
  Device device;
  Report report;

  Timing time(const std::function<void()>& work);
  /// Adds the row with the time of `work`, if it is wanted.
  void run(Row row, const std::function<void()>& work);
  void finish() const { report.finish(arguments.json); }
};

}  // namespace degas::bench
