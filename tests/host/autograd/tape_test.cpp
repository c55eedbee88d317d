#include "host/autograd/tape.h"

#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("gradients of a tensor used several times add up; constants get none") {
  Device& device = test::device(KernelSet::Wide);
  Tensor x = random_tensor(device, {20}, 1).set_requires_gradient();
  const Tensor constant = random_tensor(device, {20}, 2);
  Tape tape(device);
  const Tensor y = add(tape, multiply(tape, x, x), multiply(tape, x, constant));
  tape.backward(sum(tape, y));
  const std::vector<double> values = x.to_host<double>(), c = constant.to_host<double>();
  std::vector<double> expected(20);
  for (int i = 0; i < 20; ++i) expected[i] = 2 * values[i] + c[i];
  CHECK(largest_difference(x.gradient().to_host<double>(), expected) < 1e-6);
  CHECK(!constant.has_gradient());
  CHECK(!y.has_gradient());
  CHECK(tape.length() == 0);
}

TEST_CASE("a tape that does not record keeps nothing") {
  Device& device = test::device(KernelSet::Wide);
  const Tensor x = random_tensor(device, {20}, 1).set_requires_gradient();
  Tape tape(device, false);
  CHECK(!add(tape, x, x).requires_gradient());
  CHECK(tape.length() == 0);
}

TEST_CASE("tensors that share a gradient do not see what is added to another's") {
  Device& device = test::device(KernelSet::Wide);
  Tensor x = random_tensor(device, {70}, 1).set_requires_gradient();
  Tensor y = random_tensor(device, {70}, 2).set_requires_gradient();
  Tape tape(device);
  const Tensor tripled = scale(tape, x, 3);
  // Walking back, the sum gives x and y one gradient; then x has the tripled one's added to its own.
  tape.backward(sum(tape, add(tape, tripled, add(tape, x, y))));
  CHECK(x.gradient().to_host<float>() == std::vector<float>(70, 4.0f));
  CHECK(y.gradient().to_host<float>() == std::vector<float>(70, 1.0f));
  CHECK(!y.gradient_is_shared());
}

TEST_CASE("backward runs only where the loss depends, and leaves accumulate over steps") {
  Device& device = test::device(KernelSet::Wide);
  Tensor x = random_tensor(device, {5}, 1).set_requires_gradient();
  Tensor unused = random_tensor(device, {5}, 2).set_requires_gradient();
  for (int step = 1; step <= 2; ++step) {
    Tape tape(device);
    scale(tape, unused, 3);
    tape.backward(sum(tape, scale(tape, x, 2)));
    CHECK(x.gradient().to_host<float>() == std::vector<float>(5, 2.0f * static_cast<float>(step)));
  }
  CHECK(!unused.has_gradient());
  CHECK_THROWS_AS(Tape(device).backward(x), std::logic_error);
}

TEST_CASE("a repeated step allocates nothing on the device") {
  Device& device = test::device(KernelSet::Wide);
  Tensor x = random_tensor(device, {3000}, 1).set_requires_gradient();
  const auto step = [&] {
    x.clear_gradient();
    Tape tape(device);
    tape.backward(mean(tape, multiply(tape, x, scale(tape, x, 2, 1))));
  };
  step();
  const size_t allocations = device.memory_statistics().device_allocations;
  for (int i = 0; i < 3; ++i) step();
  CHECK(device.memory_statistics().device_allocations == allocations);
}

TEST_CASE("a tensor that gave its values back keeps its shape and gradient, and says so when it is read") {
  Device& device = test::device(KernelSet::Wide);
  Tensor x = random_tensor(device, {4}, 1);
  const Tensor rest = x.without_values();
  CHECK(rest.shape() == x.shape());
  x.set_gradient(Tensor::zeros(device, {4}));
  CHECK(rest.has_gradient());
  CHECK_THROWS_AS(rest.to_host<float>(), std::logic_error);
}
