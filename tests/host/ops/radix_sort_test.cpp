#include "host/ops/radix_sort.h"

#include <algorithm>
#include <numeric>
#include <random>

#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

std::vector<int32_t> random_keys(int64_t count, uint32_t largest, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<int32_t> keys(count);
  for (int32_t& key : keys) key = static_cast<int32_t>(random() % (uint64_t{largest} + 1));
  return keys;
}

Tensor upload_keys(Device& device, const std::vector<int32_t>& values) {
  Tensor tensor(device, {static_cast<int64_t>(values.size())}, Element::UInt32);
  tensor.upload(std::span<const int32_t>(values));
  return tensor;
}

}  // namespace

TEST_CASE("radix sort is a stable sort by the lowest bits", "[large]") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const int64_t count = GENERATE(1, 2, 255, 257, 1023, 1025, 20011);
  const auto [largest, bits] = GENERATE(std::pair{0xFFFFFFFFu, 32}, std::pair{1023u, 10}, std::pair{8191u, 13},
                                        std::pair{3u, 2}, std::pair{0u, 1});
  const std::vector<int32_t> keys = random_keys(count, largest, 5);
  std::vector<int32_t> places(count);
  std::iota(places.begin(), places.end(), 0);
  std::stable_sort(places.begin(), places.end(), [&](int32_t a, int32_t b) {
    return static_cast<uint32_t>(keys[a]) < static_cast<uint32_t>(keys[b]);
  });
  CHECK(sorted_places(upload_keys(device, keys), count, bits).to_host<int32_t>() == places);
}

TEST_CASE("radix sort leaves alone what lies behind the count") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const std::vector<int32_t> keys = {9, 4, 7, 0, 1, 2};
  const std::vector<int32_t> places = sorted_places(upload_keys(device, keys), 3, 4).to_host<int32_t>();
  CHECK(std::vector<int32_t>(places.begin(), places.begin() + 3) == std::vector<int32_t>{1, 2, 0});
}

TEST_CASE("exclusive scan sums before each element and in all") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const int64_t count = GENERATE(1, 255, 256, 257, 20011);
  const std::vector<int32_t> values = random_keys(count, 1000, 6);
  std::vector<int32_t> expected(count);
  std::exclusive_scan(values.begin(), values.end(), expected.begin(), 0);
  std::vector<int32_t> with_room = values;
  with_room.insert(with_room.end(), {7, 7, 7});
  const Scan scan = exclusive_scan(upload_keys(device, with_room), count);
  std::vector<int32_t> sums = scan.sums.to_host<int32_t>();
  sums.resize(count);
  CHECK(sums == expected);
  uint64_t total = 0;
  device.download(scan.totals.memory(), &total, sizeof(total), scan.total_index * sizeof(total));
  CHECK(total == static_cast<uint64_t>(std::accumulate(values.begin(), values.end(), int64_t{0})));
}
