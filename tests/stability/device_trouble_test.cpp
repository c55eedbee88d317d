// A device that is lost, full, cannot build or is smaller than usual, by the layer in tests/failing_opencl.
#include "host/device/device.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;

namespace {

/// tiny_config for so many steps, with a checkpoint after each second one.
Config six_steps_saved_every_other() {
  Config config = tiny_config();
  config.train.iterations = 6;
  config.train.checkpoint_every = 2;
  return config;
}

struct Trouble {
  Environment environment;
  std::filesystem::path log;

  Trouble(const TemporaryFolder& folder, const std::string& which) : log(folder / "troubles") {
    environment = {{"LD_PRELOAD", DEGAS_FAILING_OPENCL}, {"FAILING_OPENCL", which}, {"FAILING_OPENCL_LOG", log}};
  }
  bool was_made(const std::string& line = "") const {
    return std::filesystem::exists(log) && file_text(log).find(line) != std::string::npos;
  }
};

std::string checkpoint_of(const TrainCommand& train) {
  return file_text(train.run / "checkpoint.bin");
}

std::string device_name() {
  return Device().description().name;
}

/// What an undisturbed run of `config` leaves.
std::string undisturbed(const Config& config) {
  const TemporaryFolder folder;
  const TrainCommand train(folder, config);
  REQUIRE(train().exit_code == 0);
  return checkpoint_of(train);
}

/// Training in trouble is refused by a line with these parts; without it the run goes on.
void check_ends_and_goes_on(const std::string& which, const std::vector<std::string>& parts) {
  CAPTURE(which);
  const TemporaryFolder folder;
  const Config config = six_steps_saved_every_other();
  const std::string whole = undisturbed(config);
  TrainCommand train(folder, config);
  const Trouble trouble(folder, which);
  train.environment = trouble.environment;
  check_refused(train(), parts);
  CHECK(trouble.was_made());
  train.environment = {};
  train.more = {"--resume"};
  CHECK(train().exit_code == 0);
  const bool same_bits = checkpoint_of(train) == whole;
  CHECK(same_bits);
}

/// Training in trouble, which leaves `line` in the log, ends with the bits of an undisturbed run.
void check_unharmed(const std::string& which, const std::string& line) {
  CAPTURE(which);
  const TemporaryFolder folder;
  const Config config = six_steps_saved_every_other();
  TrainCommand train(folder, config);
  const Trouble trouble(folder, which);
  train.environment = trouble.environment;
  train.environment.emplace_back("DEGAS_CACHE", folder / "cache");  // no program that was built without the trouble
  const ProgramResult result = train();
  CAPTURE(result.errors);
  CHECK(result.exit_code == 0);
  CHECK(trouble.was_made(line));
  const bool same_bits = checkpoint_of(train) == undisturbed(config);
  CHECK(same_bits);
}

}  // namespace

TEST_CASE("a device that is lost ends training in one line, and the run goes on to the same bits") {
  const std::string call =
      GENERATE("clEnqueueNDRangeKernel:1", "clEnqueueNDRangeKernel:2500", "clSetKernelArg:5000", "clCreateBuffer:200",
               "clBuildProgram:5", "clEnqueueReadBuffer:7", "clEnqueueWriteBuffer:30", "clEnqueueFillBuffer:20");
  check_ends_and_goes_on(call, {"device " + device_name() + ": lost in ", "--resume"});
}

TEST_CASE("memory that runs out ends training in one line, and the run goes on to the same bits") {
  const int buffer = GENERATE(1, 120);
  check_ends_and_goes_on("memory:" + std::to_string(buffer), {"device out of memory", "lower net.resolution"});
}

TEST_CASE("a driver that finds no memory only when a kernel is launched is told of in one line as well") {
  check_ends_and_goes_on("late:2500", {"device out of memory in ", "lower net.resolution"});
}

TEST_CASE("a buffer that finds no memory once finds what the pool gives back") {
  check_unharmed("squeeze:120", "memory");
}

TEST_CASE("a driver that builds nothing is named in one line, and its log is kept") {
  const TemporaryFolder folder;
  TrainCommand train(folder, six_steps_saved_every_other());
  const Trouble trouble(folder, "build");
  train.environment = trouble.environment;
  train.environment.emplace_back("DEGAS_CACHE", folder / "cache");
  check_refused(train(), {"device " + device_name() + ": its driver", "does not build kernels/", "status -11", ".log"});
  CHECK(trouble.was_made());
  CHECK(!std::filesystem::is_empty(folder / "cache/programs"));
}

TEST_CASE("a GPU too small for cooperative work-groups runs the other kernel set, to the bits of such a CPU") {
  const TemporaryFolder folder;
  const Config config = six_steps_saved_every_other();
  TrainCommand train(folder, config);
  const Trouble trouble(folder, "gpu,small");
  train.environment = trouble.environment;
  const ProgramResult result = train();
  CAPTURE(result.errors);
  CHECK(result.exit_code == 0);
  CHECK(trouble.was_made("gpu"));
  CHECK(trouble.was_made("small"));
  CHECK_FALSE(trouble.was_made("group refused"));
  if (Device().family() != DeviceFamily::WideCpu) return;  // whose parameters the set has on a GPU
  // A CPU with more local memory has convolutions of its own, by Winograd's filtering, to other bits.
  const TemporaryFolder cpu_folder;
  TrainCommand on_cpu(cpu_folder, config);
  const Trouble small(cpu_folder, "small");
  on_cpu.environment = small.environment;
  REQUIRE(on_cpu().exit_code == 0);
  CHECK(small.was_made("small"));
  const bool same_bits = checkpoint_of(train) == checkpoint_of(on_cpu);
  CHECK(same_bits);
}

TEST_CASE("a GPU that refuses a work-group it said it holds is told with the remedy, which works") {
  const TemporaryFolder folder;
  TrainCommand train(folder, six_steps_saved_every_other());
  const Trouble trouble(folder, "gpu,registers");
  train.environment = trouble.environment;
  check_refused(train(), {"device " + device_name() + ": too few registers", "--kernels wide"});
  CHECK(trouble.was_made("group refused"));
  train.more = {"--kernels", "wide"};
  CHECK(train().exit_code == 0);
}

TEST_CASE("training needs no double precision") {
  check_unharmed("no_double", "source without double");
}
