#include "host/ops/lpips.h"

#include "host/autograd/gradient_check.h"
#include "host/io/npz.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

const NpzFile& vectors() {
  static const NpzFile file(std::string(DEGAS_TEST_VECTORS) + "/lpips.npz");
  return file;
}

LpipsConvolution convolution(const std::string& name, int stride, int padding) {
  const NpyArray weight = vectors().read(name + ".weight");
  return {weight.shape, weight.floats(), vectors().read(name + ".bias").floats(), stride, padding};
}

/// Every kind of layer once.
std::vector<LpipsLayer> tiny_network() {
  using Kind = LpipsLayer::Kind;
  return {{Kind::Convolution, {convolution("first", 2, 2)}, false, vectors().read("lin0").floats()},
          {Kind::Pool, {}, true, {}},
          {Kind::Fire,
           {convolution("squeeze", 1, 0), convolution("narrow", 1, 0), convolution("wide", 1, 1)},
           false,
           vectors().read("lin1").floats()}};
}

Tensor stored_tensor(Device& device, const std::string& key) {
  const NpyArray array = vectors().read(key);
  return Tensor::from(device, array.shape, std::span<const double>(array.doubles()));
}

}  // namespace

TEST_CASE("LPIPS on a tiny network equals torch, value and gradient") {
  const auto set = GENERATE(from_range(kernel_sets()));
  const auto real = GENERATE(Real::Float, Real::Double);
  Device& device = test::device(set, real);
  const Lpips lpips(device, tiny_network());
  const Tensor image = stored_tensor(device, "image").set_requires_gradient(), target = stored_tensor(device, "target");
  Tape tape(device);
  const Tensor distance = lpips.distance(tape, image, target);
  tape.backward(distance);
  // The linear weights pass through float on the host.
  const double bar = real == Real::Double ? 1e-7 : 1e-5;
  CHECK(largest_difference(distance.to_host<double>(), vectors().read("distance").doubles()) < bar);
  CHECK(largest_difference(image.gradient().to_host<double>(), vectors().read("gradient").doubles()) < bar);
  CHECK_FALSE(target.has_gradient());
}

TEST_CASE("the gradient of LPIPS passes finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const Lpips lpips(device, tiny_network());
  const Tensor image = stored_tensor(device, "image").set_requires_gradient(), target = stored_tensor(device, "target");
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{lpips.distance(tape, in[0], target)};
  };
  CHECK(gradient_check(device, function, {image}, {.samples_per_input = 32}) < 1e-5);
}

TEST_CASE("LPIPS of an image with itself is 0 with a zero gradient; features of length zero give none") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Lpips lpips(device, tiny_network());
  const Tensor image = stored_tensor(device, "image").set_requires_gradient();
  Tape tape(device);
  const Tensor distance = lpips.distance(tape, image, image);
  tape.backward(distance);
  // Contraction to fused multiply-add leaves the last bit of the unit features.
  CHECK(distance.to_host<double>()[0] < 1e-12);
  CHECK(largest_difference(image.gradient().to_host<double>(), std::vector<double>(image.size(), 0.0)) < 1e-7);

  // No bias: a grey that the input layer maps to zero has features of length zero everywhere.
  LpipsConvolution first = convolution("first", 1, 0);
  std::fill(first.bias.begin(), first.bias.end(), 0.0f);
  std::fill(first.weight.begin(), first.weight.end(), -1.0f);
  const Lpips dead(device, {{LpipsLayer::Kind::Convolution, {first}, false, std::vector<float>(7, 1.0f)}});
  const Tensor white =
      Tensor::from(device, {5, 5, 3}, std::span<const double>(std::vector<double>(75, 1.0))).set_requires_gradient();
  Tape second(device);
  second.backward(dead.distance(second, white, Tensor::zeros(device, {5, 5, 3})));
  CHECK(white.gradient().to_host<double>() == std::vector<double>(75, 0.0));
}

TEST_CASE("LPIPS refuses images below its least size, and misfit weights") {
  Device& device = test::device(KernelSet::Wide);
  const Lpips lpips(device, tiny_network());
  CHECK(lpips.smallest_side() == 3);
  Tape tape(device);
  CHECK_THROWS_AS(lpips.distance(tape, random_tensor(device, {2, 9, 3}, 1), random_tensor(device, {2, 9, 3}, 2)),
                  std::logic_error);
  std::vector<LpipsLayer> layers = tiny_network();
  layers[0].feature_weights.pop_back();
  CHECK_THROWS_AS(Lpips(device, layers), std::logic_error);
}
