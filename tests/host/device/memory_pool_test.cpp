#include "host/device/memory_pool.h"

#include "host/error.h"
#include "tests/support/test_devices.h"

using namespace degas;

TEST_CASE("size classes hold what is asked for and waste little") {
  for (size_t bytes : {1u, 255u, 256u, 257u, 4096u, 4097u, 5000u, 65536u, 65537u, 1000003u, 123456789u}) {
    const size_t size = memory_size_class(bytes);
    CHECK(size >= bytes);
    CHECK(size % 256 == 0);
    if (bytes > 4096) CHECK(static_cast<double>(size) <= 1.125 * static_cast<double>(bytes) + 256);
    CHECK(memory_size_class(size) == size);
  }
}

TEST_CASE("memory that was let go is used again") {
  Device& device = test::device(KernelSet::Wide);
  { Tensor first(device, {1000, 1000}); }
  const auto before = device.memory_statistics();
  for (int i = 0; i < 5; ++i) Tensor again(device, {1000, 1000});
  CHECK(device.memory_statistics().device_allocations == before.device_allocations);
  CHECK(device.memory_statistics().bytes_in_use == before.bytes_in_use);
}

TEST_CASE("a full device says what was asked for and what is in use, and recovers") {
  DeviceOptions options;
  options.memory_limit = 8 << 20;
  auto& device = *new Device(options);  // never destroyed: see test_devices.cpp
  const Tensor kept(device, {1 << 20});
  CHECK_THROWS_WITH(Tensor(device, {2 << 20}), Catch::Contains("out of memory") && Catch::Contains("views_per_step"));
  { Tensor fits(device, {1 << 19}); }
  // The free half-size buffer is given back to make room for a size never seen.
  CHECK_NOTHROW(Tensor(device, {1000000}));
}
