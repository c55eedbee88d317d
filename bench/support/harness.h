#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/device/device.h"

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

/// Fused multiply-adds on registers: the device's rate in GFLOP/s, the roof that shares are told against.
double measure_fma_peak(Device& device, Clock clock = Clock::Wall);

/// Command line of every benchmark: [--json FILE] [--device SELECTOR] [--filter TEXT] [--clock wall|cpu]; prints help
/// and exits on others.
struct Arguments {
  std::string json, device, filter;
  Clock clock = Clock::Wall;
};
Arguments parse_arguments(int count, char** values);

/// One measured piece of work beside its peer, if it has one.
struct Row {
  std::string name;
  Timing time;
  double gflop = 0;  ///< 10^9 operations in a run; 0: not counted
  std::optional<Timing> peer_time;
  std::string peer;
  std::string kind = {};  ///< rows of one kind get a mean ratio of their own; empty: none
  std::vector<std::pair<std::string, double>> details = {};  ///< further numbers by name, printed behind the row
};

/// Prints a table as rows come in; finish() prints the totals and writes the JSON file {"results": [{"name", "ms",
/// "best_ms", "spread", "gflops", "share_of_peak", "peer", "peer_ms", "peer_best_ms", "ratio", details}],
/// "geomean_ratio", "geomean_ratios" by kind, "peak_gflops", "load_average", "busy"}. ratio = peer_best_ms / best_ms,
/// above 1 we are faster; of the best times, since company on the machine only ever adds to them. busy: others had the
/// machine at the start, so that no figure is to be quoted; it is printed too.
class Report {
 public:
  /// peak_gflops 0: no shares.
  Report(std::string title, double peak_gflops);
  void add(const Row& row);
  void finish(const std::string& json_file) const;

 private:
  double peak_gflops_;
  double load_average_;
  bool busy_;
  std::vector<Row> rows_;
};

}  // namespace degas::bench
