// A whole training step: steps/s, launches, device memory, and the stages of it by the profile of `degas train
// --profile`. Pictures have the size that a case names; quick.json cuts them to the person.
#include <fmt/format.h>

#include <map>

#include "bench/support/harness.h"
#include "bench/support/subject.h"
#include "model/train/trainer.h"

using namespace degas;
using namespace degas::bench;

namespace {

constexpr int measurements = 5;

/// Trains for a measurement's steps to warm up, and then for each measurement; tells when they end.
void train(Device& device, const Subject& subject, const WholeCase& c, const std::function<void()>& measured) {
  Config config = benchmark_config(c.config);
  config.train.validation_every = config.train.checkpoint_every = 0;
  config.train.log_every = c.training_steps;
  config.train.iterations = (1 + measurements) * c.training_steps;
  const RunFolder run(subject.folder() / (device.profiles() ? "profiled" : "run"));
  run.create(config, subject.body());
  const std::unique_ptr<Capture> capture = subject.capture();
  Trainer trainer(device, config, *capture, run);
  TrainingBudget budget;
  budget.iterations = config.train.iterations;
  trainer.run(budget, [&](const TrainingReport&) { measured(); });  // a report has waited for the device
}

/// The step as it is, by the given clock.
Row measure_step(DeviceOptions options, const Subject& subject, const WholeCase& c, Clock clock) {
  Device device(options);
  std::vector<double> readings;
  size_t launches_before = 0, allocations_before = 0, bytes_before = 0;
  train(device, subject, c, [&] {
    if (readings.empty()) {
      launches_before = device.launches();
      allocations_before = device.memory_statistics().device_allocations;
      bytes_before = device.memory_statistics().bytes_held;
    }
    readings.push_back(now(clock));
  });
  std::vector<double> times;
  for (int i = 0; i < measurements; ++i) times.push_back((readings[i + 1] - readings[i]) / c.training_steps);
  const MemoryPool::Statistics memory = device.memory_statistics();
  Row row;
  row.time = timing_of(times);
  const double mebibyte = 1 << 20;
  row.details = {
      {"steps_per_second", 1e3 / row.time.median},
      {"launches", static_cast<double>(device.launches() - launches_before) / (measurements * c.training_steps)},
      {"allocations", static_cast<double>(memory.device_allocations - allocations_before)},
      {"allocated_mib", static_cast<double>(memory.bytes_held - bytes_before) / mebibyte},
      {"peak_mib", static_cast<double>(memory.peak_bytes_in_use) / mebibyte},
      {"held_mib", static_cast<double>(memory.bytes_held) / mebibyte}};
  return row;
}

/// The kind of work within a stage, where it is worth a row of its own.
std::string part_of(const Profiler::Row& row) {
  static const std::map<std::string, std::string> parts = {{"conv2d", "convolution"},
                                                           {"conv2d_rows", "convolution"},
                                                           {"conv2d_winograd", "convolution"},
                                                           {"conv2d_packing", "convolution"},
                                                           {"conv2d_gradient", "convolution"},
                                                           {"conv2d_gradient_rows", "convolution"},
                                                           {"conv2d_gradient_winograd", "convolution"},
                                                           {"weight_norm", "weight norm"},
                                                           {"lpips", "LPIPS"},
                                                           {"ssim_wide", "L1 + SSIM"},
                                                           {"ssim_gpu", "L1 + SSIM"},
                                                           {"projection", "projection"},
                                                           {"raster_wide", "raster"},
                                                           {"raster_gpu", "raster"},
                                                           {"intersection_wide", "intersection"},
                                                           {"intersection_gpu", "intersection"},
                                                           {"image", "pictures"},
                                                           {"radix_sort", "intersection"},
                                                           {"memory", "fill, copy, upload"}};
  const auto part = parts.find(row.kernel.substr(0, row.kernel.find('/')));
  return fmt::format("{}{}{}", row.stage.name, part == parts.end() ? "" : ", " + part->second,
                     row.stage.backward ? ", backward" : "");
}

/// A row for every stage, by the device's own clock, and one for the time between: host, loader, launches.
std::vector<Row> measure_stages(DeviceOptions options, const Subject& subject, const WholeCase& c) {
  options.profile = true;
  Device device(options);
  std::map<std::string, std::vector<double>> times;
  std::map<std::string, double> launches;
  int measured = -1;
  double before = 0;
  train(device, subject, c, [&] {
    double between = now(Clock::Wall) - before;
    const std::vector<Profiler::Row> profile = device.take_profile();
    if (++measured > 0) {
      for (const Profiler::Row& kernel : profile) {
        std::vector<double>& samples = times[part_of(kernel)];
        samples.resize(measured);
        samples.back() += kernel.milliseconds / c.training_steps;
        launches[part_of(kernel)] += static_cast<double>(kernel.launches) / (measurements * c.training_steps);
        between -= kernel.milliseconds;
      }
      times["between launches"].push_back(between / c.training_steps);
    }
    before = now(Clock::Wall);
  });
  std::vector<Row> rows;
  for (auto& [name, samples] : times) {
    samples.resize(measurements);  // 0 where a measurement had none of it
    Row row;
    row.name = name;
    row.time = timing_of(samples);
    if (launches[name] > 0) row.details = {{"launches", launches[name]}};
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

int main(int count, char** values) {
  const Arguments arguments = parse_arguments(count, values);
  Report report("training step; stages by the device's clock", {});
  for (const WholeCase& c : whole_cases) {
    if (!arguments.wants(c.name())) continue;
    const Subject subject(c.width, c.height);
    fmt::print("{}: {}\n", c.name(), subject.name());
    Row step = measure_step(arguments.device_options(), subject, c, arguments.clock);
    step.name = c.name() + "/step";
    report.add(step);
    for (Row& row : measure_stages(arguments.device_options(), subject, c)) {
      row.name = fmt::format("{}/{}", c.name(), row.name);
      report.add(row);
    }
  }
  report.finish(arguments.json);
}
