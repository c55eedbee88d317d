#include "host/ops/linear.h"

#include "host/autograd/gradient_check.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

struct LinearCase {
  int batch, inputs, outputs;
  bool bias;
  double slope;
};

}  // namespace

TEST_CASE("linear equals the plain loop") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const LinearCase c = GENERATE(LinearCase{1, 1, 1, true, 1}, LinearCase{3, 65, 17, false, 0.2},
                                LinearCase{2, 200, 131, true, 0.2}, LinearCase{1, 512, 64, true, 0});
  const Tensor input = random_tensor(device, {c.batch, c.inputs}, 1),
               weight = random_tensor(device, {c.inputs, c.outputs}, 2);
  const Tensor bias = c.bias ? random_tensor(device, {c.outputs}, 3) : Tensor();
  const std::vector<double> x = input.to_host<double>(), w = weight.to_host<double>();
  const std::vector<double> b = c.bias ? bias.to_host<double>() : std::vector<double>(c.outputs, 0.0);
  std::vector<double> expected;
  for (int n = 0; n < c.batch; ++n) {
    for (int o = 0; o < c.outputs; ++o) {
      double sum = b[o];
      for (int i = 0; i < c.inputs; ++i) sum += x[n * c.inputs + i] * w[i * c.outputs + o];
      expected.push_back(sum > 0 ? sum : c.slope * sum);
    }
  }
  Tape tape(device, false);
  CHECK(largest_difference(linear(tape, input, weight, bias, c.slope).to_host<double>(), expected) < 1e-5);
}

TEST_CASE("linear's gradient passes finite differences") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  const LinearCase c =
      GENERATE(LinearCase{1, 1, 1, true, 1}, LinearCase{3, 65, 17, false, 0.2}, LinearCase{2, 70, 131, true, 0.2});
  std::vector<Tensor> inputs = {random_tensor(device, {c.batch, c.inputs}, 1),
                                random_tensor(device, {c.inputs, c.outputs}, 2)};
  if (c.bias) inputs.push_back(random_tensor(device, {c.outputs}, 3));
  for (Tensor& input : inputs) input.set_requires_gradient();
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    return std::vector{linear(tape, in[0], in[1], c.bias ? in[2] : Tensor(), c.slope)};
  };
  CHECK(gradient_check(device, function, inputs) < 1e-6);
}
