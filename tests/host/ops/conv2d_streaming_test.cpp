#include <random>

#include "host/ops/conv2d.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

constexpr int size = 520, channels = 16;  // a map of 16.5 MiB, beyond what a CPU keeps in its caches

}  // namespace

TEST_CASE("maps beyond the caches equal the plain loops at many places, values and gradients", "[large]") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const int kernel_size = GENERATE(1, 3), padding = kernel_size / 2;
  const bool has_bias = GENERATE(false, true);
  Tensor input = random_tensor(device, {1, size, size, channels}, 1).set_requires_gradient();
  const Tensor weight = random_tensor(device, {1, kernel_size, kernel_size, channels, channels}, 2);
  const Tensor bias = has_bias ? random_tensor(device, {channels}, 3) : Tensor();
  const Tensor factor = random_tensor(device, {1, size, size, channels}, 4);
  Tape tape(device);
  const Tensor output = conv2d(tape, input, weight, bias, {.padding = padding});
  tape.backward(sum(tape, multiply(tape, output, factor)));

  const auto in = input.to_host<double>(), out = output.to_host<double>(), w = weight.to_host<double>(),
             d_out = factor.to_host<double>(), d_in = input.gradient().to_host<double>();
  const auto b = has_bias ? bias.to_host<double>() : std::vector<double>(channels);
  const auto at = [](int y, int x) { return (static_cast<size_t>(y) * size + x) * channels; };
  std::mt19937 random(5);
  std::uniform_int_distribution<int> place(0, size - 1);
  double worst = 0, worst_gradient = 0;
  for (int sample = 0; sample < 4000; ++sample) {
    // The corners and edges too.
    const int y = sample % 7 ? place(random) : sample % 2 * (size - 1), x = sample % 5 ? place(random) : size - 1;
    for (int c = 0; c < channels; ++c) {
      double expected = b[c], gradient = 0;
      for (int ky = 0; ky < kernel_size; ++ky) {
        for (int kx = 0; kx < kernel_size; ++kx) {
          const size_t tap = static_cast<size_t>(ky * kernel_size + kx) * channels * channels;
          const int in_y = y - padding + ky, in_x = x - padding + kx, out_y = y + padding - ky,
                    out_x = x + padding - kx;
          const bool reads = in_y >= 0 && in_y < size && in_x >= 0 && in_x < size;
          const bool is_read = out_y >= 0 && out_y < size && out_x >= 0 && out_x < size;
          for (int k = 0; k < channels; ++k) {
            if (reads) expected += in[at(in_y, in_x) + k] * w[tap + k * channels + c];
            if (is_read) gradient += d_out[at(out_y, out_x) + k] * w[tap + c * channels + k];
          }
        }
      }
      worst = std::max(worst, std::abs(out[at(y, x) + c] - expected));
      worst_gradient = std::max(worst_gradient, std::abs(d_in[at(y, x) + c] - gradient));
    }
  }
  CHECK(worst < 2e-5);
  CHECK(worst_gradient < 2e-5);
}
