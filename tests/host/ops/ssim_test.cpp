#include "host/ops/ssim.h"

#include <algorithm>
#include <cmath>

#include "host/autograd/gradient_check.h"
#include "host/io/npz.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

Tensor stored_image(Device& device, const NpzFile& file, const std::string& key) {
  const NpyArray array = file.read(key);
  return Tensor::from(device, array.shape, std::span<const double>(array.doubles()));
}

Tensor constant(Device& device, const Shape& shape, double value) {
  return Tensor::from(device, shape, std::span<const double>(std::vector<double>(element_count(shape), value)));
}

}  // namespace

TEST_CASE("L1 + SSIM and its gradient equal torch in double precision, borders included") {
  const auto set = GENERATE(from_range(kernel_sets()));
  const auto real = GENERATE(Real::Float, Real::Double);
  const std::string name = GENERATE("small", "odd", "wide", "gray", "figures");
  Device& device = test::device(set, real);
  const NpzFile file(std::string(DEGAS_TEST_VECTORS) + "/ssim.npz");
  const Tensor image = stored_image(device, file, name + "_image").set_requires_gradient(),
               target = stored_image(device, file, name + "_target");
  Tape tape(device);
  const Tensor loss = l1_ssim_loss(tape, image, target, 0.2);
  tape.backward(loss);
  const double bar = real == Real::Double ? 1e-12 : 1e-6;
  CHECK(std::abs(loss.to_host<double>()[0] - file.read(name + "_loss").doubles()[0]) < bar);
  std::vector<double> got = image.gradient().to_host<double>(), expected = file.read(name + "_gradient").doubles();
  // A mean's gradient is small: compare it times the number of elements.
  for (auto* values : {&got, &expected}) {
    for (double& value : *values) value *= static_cast<double>(image.size());
  }
  CHECK(largest_difference(got, expected) < 20 * bar);
}

TEST_CASE("SSIM as a measure covers the valid region") {
  const auto set = GENERATE(from_range(kernel_sets()));
  const std::string name = GENERATE("odd", "wide", "gray");
  Device& device = test::device(set);
  const NpzFile file(std::string(DEGAS_TEST_VECTORS) + "/ssim.npz");
  const double value = ssim(stored_image(device, file, name + "_image"), stored_image(device, file, name + "_target"))
                           .to_host<double>()[0];
  CHECK(value == Approx(file.read(name + "_ssim").doubles()[0]).epsilon(1e-6));
}

TEST_CASE("SSIM never exceeds 1 and equal images have exactly 1", "[large]") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Shape shape{19, 21, 3};
  for (const double level : {0.0, 0.3, 0.6, 1.0}) {
    for (const double step : {0.0, 1e-7, -1e-7, 1e-4}) {
      const Tensor a = constant(device, shape, level), b = constant(device, shape, level + step);
      CHECK(ssim(a, b).to_host<double>()[0] <= 1.0);
      Tape tape(device);
      Tensor image = constant(device, shape, level).set_requires_gradient();
      const Tensor loss = l1_ssim_loss(tape, image, b, 1.0);
      tape.backward(loss);
      CHECK(loss.to_host<double>()[0] >= 0.0);
      for (double g : image.gradient().to_host<double>()) REQUIRE(std::isfinite(g));
    }
  }
  const Tensor noise = random_tensor(device, shape, 1, 0, 1);
  CHECK(ssim(noise, noise).to_host<double>()[0] == 1.0);
}

TEST_CASE("the gradient of L1 + SSIM passes finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const Shape shape = GENERATE(Shape{1, 1, 3}, Shape{7, 19, 3}, Shape{18, 91, 3});
  const Tensor image = random_tensor(device, shape, 1, 0, 1).set_requires_gradient();
  const Tensor target = random_tensor(device, shape, 2, 0, 1);
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{l1_ssim_loss(tape, in[0], target, 0.6)};
  };
  CHECK(gradient_check(device, function, {image}, {.samples_per_input = 24}) < 1e-6);
}

TEST_CASE("where two pictures share their background there is no gradient") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const NpzFile file(std::string(DEGAS_TEST_VECTORS) + "/ssim.npz");
  const Tensor image = stored_image(device, file, "figures_image").set_requires_gradient();
  Tape tape(device);
  tape.backward(l1_ssim_loss(tape, image, stored_image(device, file, "figures_target"), 0.2));
  const std::vector<float> gradient = image.gradient().to_host<float>();
  const auto row = gradient.begin() + 8 * 180 * 3;
  CHECK(std::all_of(row, row + 50 * 3, [](float value) { return value == 0; }));
  CHECK(std::any_of(row + 62 * 3, row + 82 * 3, [](float value) { return value != 0; }));
}

TEST_CASE("large images agree between the kernel sets, bit for bit from run to run", "[large]") {
  const Shape shape{97, 353, 3};
  std::vector<std::vector<double>> gradients;
  for (const KernelSet set : {KernelSet::Wide, KernelSet::Wide, KernelSet::Gpu, KernelSet::Gpu}) {
    Device& device = test::device(set);
    const Tensor image = random_tensor(device, shape, 1, 0, 1).set_requires_gradient();
    Tape tape(device);
    tape.backward(l1_ssim_loss(tape, image, random_tensor(device, shape, 2, 0, 1), 0.2));
    gradients.push_back(image.gradient().to_host<double>());
    for (double& value : gradients.back()) value *= static_cast<double>(image.size());
  }
  CHECK(gradients[0] == gradients[1]);
  CHECK(gradients[2] == gradients[3]);
  CHECK(largest_difference(gradients[0], gradients[2]) < 2e-5);
}

TEST_CASE("SSIM refuses images it cannot compare") {
  Device& device = test::device(KernelSet::Wide);
  Tape tape(device);
  CHECK_THROWS_AS(l1_ssim_loss(tape, constant(device, {4, 5, 3}, 0), constant(device, {5, 4, 3}, 0), 0.2),
                  std::logic_error);
  CHECK_THROWS_AS(ssim(constant(device, {10, 20, 3}, 0), constant(device, {10, 20, 3}, 0)), std::logic_error);
}
