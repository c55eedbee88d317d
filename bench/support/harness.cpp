#include "bench/support/harness.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

namespace degas::bench {
namespace {

double milliseconds_of(const std::function<void()>& work, const std::function<void()>& wait, int runs, Clock clock) {
  wait();
  const double begin = now(clock);
  for (int run = 0; run < runs; ++run) work();
  wait();
  return (now(clock) - begin) / runs;
}

double load_average() {
  double load = 0;
  return getloadavg(&load, 1) == 1 ? load : 0;
}

double gflops(const Row& row) {
  return row.gflop / row.time.median * 1e3;
}
double gigabytes_per_second(const Row& row) {
  return row.gigabytes / row.time.median * 1e3;
}
double ratio(const Row& row) {
  return row.peer_time->best / row.time.best;
}

double geometric_mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += std::log(value);
  return std::exp(sum / static_cast<double>(values.size()));
}

}  // namespace

double now(Clock clock) {
  if (clock == Clock::Cpu)
    return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC / std::thread::hardware_concurrency();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Timing timing_of(std::vector<double> milliseconds) {
  std::sort(milliseconds.begin(), milliseconds.end());
  const auto quantile = [&](double q) {
    return milliseconds[static_cast<size_t>(std::lround(q * static_cast<double>(milliseconds.size() - 1)))];
  };
  return {milliseconds.front(), quantile(0.5), (quantile(0.75) - quantile(0.25)) / quantile(0.5)};
}

Timing measure(const std::function<void()>& work, const std::function<void()>& wait, const MeasureOptions& options) {
  milliseconds_of(work, wait, 1, options.clock);  // builds programs
  const double estimate = milliseconds_of(work, wait, 1, options.clock);
  const int runs = std::clamp(static_cast<int>(options.batch_milliseconds / std::max(estimate, 1e-3)), 1, 1000);
  std::vector<double> times;
  for (int i = 0; i < options.repetitions; ++i) times.push_back(milliseconds_of(work, wait, runs, options.clock));
  return timing_of(times);
}

Peaks measure_peaks(Device& device, Clock clock) {
  constexpr int chains = 12, rounds = 100000;
  const MeasureOptions options{.repetitions = 7, .batch_milliseconds = 10, .clock = clock};
  const auto wait = [&] { device.finish(); };
  const Defines defines = {{"CHAINS", chains}};
  const size_t items = static_cast<size_t>(device.description().compute_units) * (device.is_wide() ? 4 : 2048);
  const Tensor output(device, {static_cast<int64_t>(items) * device.vector_width()});
  const Kernel fma = device.kernel("peak", "fma_peak", defines), copy = device.kernel("peak", "copy_peak", defines);
  const Timing fma_time = measure(
      [&] { fma.launch({items}, {device.is_wide() ? size_t{1} : size_t{256}}, output, 0.999, rounds); }, wait, options);

  const int64_t elements = (int64_t{128} << 20) / static_cast<int64_t>(device.real_bytes());
  const Tensor from = Tensor::zeros(device, {elements}), to = Tensor::zeros(device, {elements});
  const Timing copy_time = measure(
      [&] { copy.launch(device.pointwise_global(elements), device.pointwise_local(), from, to); }, wait, options);
  return {2e-6 * chains * rounds * static_cast<double>(items) * device.vector_width() / fma_time.best,
          2e-6 * static_cast<double>(from.bytes()) / copy_time.best};
}

DeviceOptions Arguments::device_options() const {
  DeviceOptions options;
  options.selector = device;
  return options;
}

Arguments parse_arguments(int count, char** values) {
  Arguments arguments;
  for (int i = 1; i < count; ++i) {
    const std::string key = values[i];
    if (key == "--clock" && i + 1 < count &&
        (values[i + 1] == std::string("cpu") || values[i + 1] == std::string("wall"))) {
      arguments.clock = values[++i] == std::string("cpu") ? Clock::Cpu : Clock::Wall;
      continue;
    }
    if (key == "--tune" && i + 1 < count &&
        (values[i + 1] == std::string("fast") || values[i + 1] == std::string("full"))) {
      arguments.tune = values[++i] == std::string("full") ? TuneMode::Full : TuneMode::Fast;
      continue;
    }
    std::string* target = key == "--json"     ? &arguments.json
                          : key == "--device" ? &arguments.device
                          : key == "--filter" ? &arguments.filter
                                              : nullptr;
    if (!target || i + 1 == count) {
      fmt::print(
          "usage: {} [--json FILE] [--device INDEX|NAME] [--filter PART_OF_A_NAME] [--clock wall|cpu] "
          "[--tune fast|full]\n",
          values[0]);
      std::exit(key == "--help" ? 0 : 2);
    }
    *target = values[++i];
  }
  return arguments;
}

Report::Report(const std::string& title, const Peaks& peaks)
    : peaks_(peaks), load_average_(load_average()), busy_(load_average_ > 0.75 * std::thread::hardware_concurrency()) {
  if (busy_) fmt::print("THE MACHINE IS BUSY (load {:.1f}): these figures are not to be quoted\n", load_average_);
  fmt::print("{}\n", title);
  if (peaks.gflops > 0) {
    fmt::print("peaks, measured: {:.0f} GFLOP/s of multiply-adds, {:.1f} GB/s of copies\n", peaks.gflops,
               peaks.gigabytes_per_second);
  }
  fmt::print("{:<52} {:>9} {:>7} {:>8} {:>8} {:>6} {:>9} {:>6}\n", "name", "ms", "spread", "GFLOP/s", "GB/s", "peak",
             "peer ms", "ratio");
}

double Report::share_of_peak(const Row& row) const {
  const auto share = [](double rate, double peak) { return peak > 0 ? rate / peak : 0; };
  return std::max(share(gflops(row), peaks_.gflops), share(gigabytes_per_second(row), peaks_.gigabytes_per_second));
}

void Report::add(const Row& row) {
  rows_.push_back(row);
  const auto cell = [](double value, const char* unit, int digits) {
    return value > 0 ? fmt::format("{:.{}f}{}", value, digits, unit) : "";
  };
  fmt::print("{:<52} {:>9.3f} {:>6.0f}% {:>8} {:>8} {:>6}", row.name, row.time.median, 100 * row.time.spread,
             cell(gflops(row), "", 0), cell(gigabytes_per_second(row), "", 1), cell(100 * share_of_peak(row), "%", 0));
  if (row.peer_time) fmt::print(" {:>9.3f} {:>6.2f}", row.peer_time->median, ratio(row));
  for (const auto& [name, value] : row.details) fmt::print("  {} {:.4g}", name, value);
  fmt::print("\n");
  std::fflush(stdout);
}

void Report::finish(const std::string& json_file) const {
  double total = 0, counted = 0, gflop = 0;  // counted: time of rows whose operations are
  std::vector<double> ratios;
  std::map<std::string, std::vector<double>> ratios_of_kinds;
  auto results = nlohmann::ordered_json::array();
  for (const Row& row : rows_) {
    nlohmann::ordered_json entry = {
        {"name", row.name}, {"ms", row.time.median}, {"best_ms", row.time.best}, {"spread", row.time.spread}};
    if (row.gflop > 0) entry["gflops"] = gflops(row);
    if (row.gigabytes > 0) entry["gigabytes_per_second"] = gigabytes_per_second(row);
    if (share_of_peak(row) > 0) entry["share_of_peak"] = share_of_peak(row);
    if (row.peer_time) {
      entry["peer"] = row.peer;
      entry["peer_ms"] = row.peer_time->median;
      entry["peer_best_ms"] = row.peer_time->best;
      entry["ratio"] = ratio(row);
      ratios.push_back(ratio(row));
      if (!row.kind.empty()) ratios_of_kinds[row.kind].push_back(ratio(row));
    }
    for (const auto& [name, value] : row.details) entry[name] = value;
    total += row.time.median;
    if (row.gflop > 0) counted += row.time.median;
    gflop += row.gflop;
    results.push_back(entry);
  }
  nlohmann::ordered_json document = {{"results", results}};
  fmt::print("total {:.2f} ms", total);
  if (gflop > 0) fmt::print(", {:.0f} GFLOP/s overall", gflop / counted * 1e3);
  if (!ratios.empty()) {
    document["geomean_ratio"] = geometric_mean(ratios);
    fmt::print(", geometric mean of peer time / our time {:.2f}", geometric_mean(ratios));
  }
  fmt::print("\n");
  for (const auto& [kind, values] : ratios_of_kinds) {
    document["geomean_ratios"][kind] = geometric_mean(values);
    fmt::print("  {}: geometric mean {:.2f}, least {:.2f}\n", kind, geometric_mean(values),
               *std::min_element(values.begin(), values.end()));
  }
  if (peaks_.gflops > 0) document["peak_gflops"] = peaks_.gflops;
  if (peaks_.gigabytes_per_second > 0) document["peak_gigabytes_per_second"] = peaks_.gigabytes_per_second;
  document["load_average"] = load_average_;
  document["busy"] = busy_;
  if (!json_file.empty()) std::ofstream(json_file) << document.dump(2) << '\n';
}

Bench::Bench(int count, char** values, const std::string& subject)
    : arguments(parse_arguments(count, values)),
      device(arguments.device_options()),
      report(subject + " on " + device.description().name, measure_peaks(device, arguments.clock)) {}

Timing Bench::time(const std::function<void()>& work) {
  return measure(work, [&] { device.finish(); }, {.clock = arguments.clock});
}

void Bench::run(Row row, const std::function<void()>& work) {
  if (!arguments.wants(row.name)) return;
  row.time = time(work);
  report.add(row);
}

}  // namespace degas::bench
