#include "host/device/device.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "host/device/program.h"
#include "host/error.h"
#include "host/ops/pointwise.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using degas::test::file_text;
namespace fs = std::filesystem;

TEST_CASE("an unknown device is refused by name, listing those that exist") {
  DeviceOptions options;
  options.selector = "no such accelerator";
  CHECK_THROWS_WITH(Device(options), Catch::Contains("no such accelerator") &&
                                         Catch::Contains(find_devices()[0].description.name));
}

TEST_CASE("kernels of a folder override the embedded ones, and a missing file is named") {
  const fs::path folder = fs::temp_directory_path() / "degas_kernel_folder";
  fs::create_directories(folder / "common");
  std::ofstream(folder / "common" / "one.cl") << "#define ONE 1\n";
  std::ofstream(folder / "a.cl") << "#include \"common/one.cl\"\n#include \"common/one.cl\"\nint x = ONE;\n";
  CHECK(kernel_source("a.cl", folder) == "#define ONE 1\nint x = ONE;\n");
  CHECK_THROWS_WITH(kernel_source("absent.cl", folder), Catch::Contains("absent.cl"));
  CHECK(kernel_source("pointwise.cl", {}).find("kernel void add") != std::string::npos);
}

TEST_CASE("denormal numbers are kept, or flushed to zero on request") {
  DeviceOptions options;
  options.flush_denormals = GENERATE(false, true);
  Device device(options);
  Tape tape(device, false);
  const double small = 1e-30;
  const Tensor product = scale(tape, Tensor::from(device, {1}, std::span<const double>(&small, 1)), 1e-10);
  CHECK((product.to_host<float>()[0] == 0) == options.flush_denormals);
}

TEST_CASE("program binaries are cached, and a damaged one is rebuilt") {
  const fs::path folder = fs::temp_directory_path() / "degas_program_cache_test";
  fs::remove_all(folder);
  setenv("DEGAS_CACHE", folder.c_str(), 1);
  const auto run = [] {
    auto& device = *new Device(DeviceOptions{});  // never destroyed: see test_devices.cpp
    Tape tape(device, false);
    const std::vector<float> values = {1, 2, 3};
    return scale(tape, Tensor::from(device, {3}, std::span<const float>(values)), 2).to_host<float>();
  };
  const std::vector<float> expected = {2, 4, 6};
  CHECK(run() == expected);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder / "programs")) files.push_back(entry.path());
  REQUIRE(files.size() == 1);
  CHECK(run() == expected);
  const std::string good = file_text(files[0]);
  std::string flipped = good;
  flipped[good.size() / 2] ^= 1;  // which a driver need not notice
  for (const std::string& damaged : {std::string("not a program"), good.substr(0, 1000), flipped, std::string()}) {
    std::ofstream(files[0], std::ios::binary | std::ios::trunc) << damaged;
    CHECK(run() == expected);
    CHECK(file_text(files[0]).size() == good.size());
    CHECK(file_text(files[0]) != damaged);
  }
  unsetenv("DEGAS_CACHE");
}

TEST_CASE("the profiler counts commands by stage and kernel") {
  DeviceOptions options;
  options.profile = true;
  auto& device = *new Device(options);
  Tape tape(device, false);
  const Tensor x = test::random_tensor(device, {100}, 1);
  device.take_profile();
  device.set_stage({"sums"});
  add(tape, add(tape, x, x), x);
  device.set_stage({"sums", true});
  Tensor(x).fill_zero();
  auto rows = device.take_profile();
  std::sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.launches > b.launches; });
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].kernel == "pointwise/add");
  CHECK(rows[0].stage.name == std::string("sums"));
  CHECK(!rows[0].stage.backward);
  CHECK(rows[0].launches == 2);
  CHECK(rows[0].milliseconds > 0);
  CHECK(rows[1].kernel == "memory/fill");
  CHECK(rows[1].stage.backward);
  CHECK(device.take_profile().empty());
}
