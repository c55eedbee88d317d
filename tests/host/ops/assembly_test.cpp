#include "host/ops/assembly.h"

#include <cmath>

#include "host/autograd/gradient_check.h"
#include "host/ops/reduction.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

/// Head maps of side x side texels and a base for every texel whose number leaves 0 or 2 when divided by 5.
struct AtlasMaps {
  AssemblyMaps maps;
  GaussianBase base;
  std::vector<int32_t> texels;

  AtlasMaps(Device& device, int side, bool leading_one) {
    const auto shape = [&](int64_t channels) {
      return leading_one ? Shape{1, side, side, channels} : Shape{side, side, channels};
    };
    maps = {random_tensor(device, shape(3), 1), random_tensor(device, shape(7), 2),
            random_tensor(device, shape(4), 3, -4, 4), random_tensor(device, shape(9), 7)};
    for (int texel = 0; texel < side * side; ++texel)
      if (texel % 5 == 0 || texel % 5 == 2) texels.push_back(texel);
    const int64_t count = texels.size();
    base = {Tensor::from(device, {count}, std::span<const int32_t>(texels)), random_tensor(device, {count, 3}, 4),
            random_tensor(device, {count, 4}, 5), random_tensor(device, {count, 3}, 6, -6, -4)};
  }
};

}  // namespace

TEST_CASE("assembly equals the formulas") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const int side = GENERATE(1, 3, 16, 37);
  const AtlasMaps scene(device, side, GENERATE(false, true));
  Tape tape(device, false);
  const CanonicalGaussians got = assemble(tape, scene.maps, scene.base, {0.05, 0.3});

  const auto d_mu = scene.maps.positions.to_host<double>(), d_turn = scene.maps.rotations_scales.to_host<double>();
  const auto shade = scene.maps.colors_opacities.to_host<double>(), mu = scene.base.positions.to_host<double>();
  const auto q = scene.base.rotations.to_host<double>(), log_scale = scene.base.log_scales.to_host<double>();
  const auto sheen = scene.maps.harmonics.to_host<double>();
  std::vector<double> positions, rotations, log_scales, opacities, colors, offsets, logits, harmonics;
  for (size_t i = 0; i < scene.texels.size(); ++i) {
    const int texel = scene.texels[i];
    double turned[4], squared = 0;
    for (int c = 0; c < 4; ++c) {
      turned[c] = q[i * 4 + c] + 0.3 * d_turn[texel * 7 + c];
      squared += turned[c] * turned[c];
    }
    for (double value : turned) rotations.push_back(value / std::sqrt(squared));
    for (int c = 0; c < 3; ++c) {
      offsets.push_back(d_mu[texel * 3 + c]);
      positions.push_back(mu[i * 3 + c] + 0.05 * d_mu[texel * 3 + c]);
      log_scales.push_back(log_scale[i * 3 + c] + d_turn[texel * 7 + 4 + c]);
      colors.push_back(std::max(0.0, 0.5 + 0.2821 * shade[texel * 4 + c]));
    }
    for (int c = 0; c < 9; ++c) harmonics.push_back(0.1 * sheen[texel * 9 + c]);
    logits.push_back(shade[texel * 4 + 3]);
    opacities.push_back(1 / (1 + std::exp(-shade[texel * 4 + 3])));
  }
  CHECK(largest_difference(got.positions.to_host<double>(), positions) < 1e-6);
  CHECK(largest_difference(got.rotations.to_host<double>(), rotations) < 3e-6);
  CHECK(largest_difference(got.log_scales.to_host<double>(), log_scales) < 1e-6);
  CHECK(largest_difference(got.opacities.to_host<double>(), opacities) < 1e-6);
  CHECK(largest_difference(got.colors.to_host<double>(), colors) < 1e-6);
  CHECK(largest_difference(got.offsets.to_host<double>(), offsets) < 1e-6);
  CHECK(largest_difference(got.opacity_logits.to_host<double>(), logits) < 1e-6);
  CHECK(got.harmonics.shape() == Shape{static_cast<int64_t>(scene.texels.size()), 3, 3});
  CHECK(largest_difference(got.harmonics.to_host<double>(), harmonics) < 1e-6);
}

TEST_CASE("assembly gradients pass finite differences and are zero at texels without a Gaussian") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())), Real::Double);
  AtlasMaps scene(device, 7, true);
  for (Tensor* map :
       {&scene.maps.positions, &scene.maps.rotations_scales, &scene.maps.colors_opacities, &scene.maps.harmonics}) {
    map->set_requires_gradient();
  }
  const auto function = [&](Tape& tape, const std::vector<Tensor>& in) {
    const CanonicalGaussians g = assemble(tape, {in[0], in[1], in[2], in[3]}, scene.base, {0.05, 0.3});
    return std::vector{g.positions, g.rotations, g.log_scales,     g.opacities,
                       g.colors,    g.offsets,   g.opacity_logits, g.harmonics};
  };
  CHECK(gradient_check(
            device, function,
            {scene.maps.positions, scene.maps.rotations_scales, scene.maps.colors_opacities, scene.maps.harmonics},
            {1e-5, 200, 1}) < 1e-6);
  const auto gradient = scene.maps.positions.gradient().to_host<double>();
  CHECK(gradient[0] != 0);
  CHECK(gradient[3] == 0);
}

TEST_CASE("maps of which only some outputs are used get the gradients of those") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  AtlasMaps scene(device, 6, false);
  scene.maps.positions.set_requires_gradient();
  scene.maps.colors_opacities.set_requires_gradient();
  Tape tape(device);
  tape.backward(sum(tape, assemble(tape, scene.maps, scene.base).offsets));
  const auto gradient = scene.maps.positions.gradient().to_host<double>();
  for (int texel = 0; texel < 36; ++texel) CHECK(gradient[texel * 3] == (texel % 5 == 0 || texel % 5 == 2 ? 1 : 0));
  for (double value : scene.maps.colors_opacities.gradient().to_host<double>()) CHECK(value == 0);
}

TEST_CASE("a NaN in the colour map is not turned into black") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  AtlasMaps scene(device, 1, false);
  const std::vector<double> broken = {NAN, 0, -9, 0};
  scene.maps.colors_opacities.upload(std::span<const double>(broken));
  Tape tape(device, false);
  const auto colors = assemble(tape, scene.maps, scene.base).colors.to_host<double>();
  CHECK(std::isnan(colors[0]));
  CHECK(colors[1] == Approx(0.5));
  CHECK(colors[2] == 0);
}
