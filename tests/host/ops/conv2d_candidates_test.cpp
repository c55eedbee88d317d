#include <map>

#include "host/io/npz.h"
#include "host/ops/conv2d.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/chosen_candidate.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

/// A device that starts from a family's parameters.
Device& device_of(DeviceFamily family) {
  static auto& devices = *new std::map<DeviceFamily, std::unique_ptr<Device>>;  // never destroyed: see test_devices.cpp
  auto& slot = devices[family];
  if (!slot) {
    DeviceOptions options;
    options.kernel_set = family <= DeviceFamily::NarrowCpu ? KernelSet::Wide : KernelSet::Gpu;
    options.family = family;
    options.poison_memory = true;
    slot = std::make_unique<Device>(options);
  }
  return *slot;
}

/// Differences of a convolution and its gradients from PyTorch's; the bar is conv2d_test.cpp's.
void check_against_torch(Device& device, const std::string& name) {
  constexpr double bar = 2e-5;
  const NpzFile file(DEGAS_TEST_VECTORS "/conv2d.npz");
  const auto stored = [&](const char* key) { return file.read(name + "." + key); };
  const auto tensor = [&](const char* key) {
    const NpyArray array = stored(key);
    return Tensor::from(device, array.shape, std::span<const float>(array.floats()));
  };
  const std::vector<double> options = stored("options").doubles();
  Tensor input = tensor("input").set_requires_gradient(), weight = tensor("weight").set_requires_gradient();
  Tensor bias = file.contains(name + ".bias") ? tensor("bias").set_requires_gradient() : Tensor();
  Tape tape(device);
  const Tensor output =
      conv2d(tape, input, weight, bias,
             {static_cast<int>(options[0]), static_cast<int>(options[1]), static_cast<int>(options[2]), options[3]});
  CHECK(largest_difference(output.to_host<double>(), stored("output").doubles()) < bar);
  tape.backward(sum(tape, multiply(tape, output, tensor("factor"))));
  CHECK(largest_difference(input.gradient().to_host<double>(), stored("input_gradient").doubles()) < bar);
  CHECK(largest_difference(weight.gradient().to_host<double>(), stored("weight_gradient").doubles()) < bar);
}

}  // namespace

TEST_CASE("every candidate of the tuner equals PyTorch, value and gradients, from every family's parameters",
          "[large]") {
  const auto family = GENERATE(DeviceFamily::WideCpu, DeviceFamily::NarrowCpu, DeviceFamily::Nvidia,
                               DeviceFamily::Intel, DeviceFamily::Mobile, DeviceFamily::OtherGpu);
  Device& device = device_of(family);
  INFO(to_string(family));
  for (const std::string name : {"grouped", "down", "k4s2", "alex", "five", "skip", "wide"}) {
    check_against_torch(device, name);
    size_t longest = 1;
    for (size_t number = 0; number < longest; ++number) {
      INFO(name << ", candidate " << number);
      auto tuner = std::make_unique<ChosenCandidate>(device, number);
      const ChosenCandidate& chosen = *tuner;
      device.set_tuner(std::move(tuner));
      check_against_torch(device, name);
      longest = std::max(longest, chosen.longest());
    }
    device.set_tuner(nullptr);
    CHECK(longest > 5);
  }
}

TEST_CASE("tuned convolutions equal the untuned ones up to rounding, and repeat to the bit", "[large]") {
  const TemporaryFolder folder;
  Device& device = device_of(GENERATE(DeviceFamily::WideCpu, DeviceFamily::Nvidia));
  const Tensor input = random_tensor(device, {1, 40, 40, 24}, 1);
  const Tensor target = random_tensor(device, {1, 40, 40, 40}, 2);
  Tensor weight = random_tensor(device, {1, 3, 3, 24, 40}, 3).set_requires_gradient();
  const auto gradient = [&] {
    weight.clear_gradient();
    Tape tape(device);
    tape.backward(sum(tape, multiply(tape, conv2d(tape, input, weight, Tensor(), {.padding = 1}), target)));
    return weight.gradient().to_host<float>();
  };
  const auto doubles = [](const std::vector<float>& values) {
    return std::vector<double>(values.begin(), values.end());
  };
  const std::vector<float> untuned = gradient();
  const auto set_tuner = [&] {
    device.set_tuner(std::make_unique<Tuner>(device, TuneMode::Fast, folder / "tuning.json"));
  };
  set_tuner();
  const std::vector<float> tuned = gradient();
  CHECK(TuningTable(folder / "tuning.json").size() == 2);  // forward, and the weights' gradient
  CHECK(largest_difference(doubles(tuned), doubles(untuned)) < 1e-4);
  CHECK(gradient() == tuned);
  set_tuner();  // another process, with the same table
  CHECK(gradient() == tuned);
  device.set_tuner(nullptr);
}
