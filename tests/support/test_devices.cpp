#include "tests/support/test_devices.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <random>

namespace degas::test {

Device& device(KernelSet kernel_set, Real real) {
  // Never destroyed: at exit the OpenCL library may be gone before this program's statics.
  static auto& devices = *new std::map<std::pair<KernelSet, Real>, std::unique_ptr<Device>>;
  auto& slot = devices[{kernel_set, real}];
  if (!slot) {
    DeviceOptions options;
    options.kernel_set = kernel_set;
    // The same kernels on every CPU, and under a simulator, whatever its vectors.
    if (kernel_set == KernelSet::Wide) options.family = DeviceFamily::WideCpu;
    options.real = real;
    options.poison_memory = true;
    slot = std::make_unique<Device>(options);
  }
  return *slot;
}

std::vector<KernelSet> kernel_sets() {
  return {KernelSet::Wide, KernelSet::Gpu};
}

std::vector<double> random_values(int64_t count, unsigned seed, double low, double high) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(low, high);
  std::vector<double> values(count);
  for (double& value : values) value = uniform(random);
  return values;
}

Tensor random_tensor(Device& device, Shape shape, unsigned seed, double low, double high) {
  const std::vector<double> values = random_values(element_count(shape), seed, low, high);
  return Tensor::from(device, std::move(shape), std::span<const double>(values));
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return INFINITY;
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double difference = std::abs(a[i] - b[i]) / (1 + std::abs(b[i]));
    if (!(difference <= largest)) largest = std::isnan(difference) ? INFINITY : difference;
  }
  return largest;
}

std::string data_path(const std::string& relative) {
  const char* root = std::getenv("DEGAS_TEST_DATA");
  if (root && *root) {
    const std::filesystem::path path = std::filesystem::path(root) / relative;
    if (std::filesystem::exists(path)) return path.string();
  }
  std::printf("SKIPPED: no %s below DEGAS_TEST_DATA (%s)\n", relative.c_str(), root && *root ? root : "not set");
  return {};
}

}  // namespace degas::test
