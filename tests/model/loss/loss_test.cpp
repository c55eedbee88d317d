#include "model/loss/loss.h"

#include <cmath>

#include "host/autograd/gradient_check.h"
#include "host/error.h"
#include "host/ops/regularizer.h"
#include "host/ops/ssim.h"
#include "host/optim/optimiser.h"
#include "model/loss/lpips_weights.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

struct Scene {
  std::vector<LossView> views;
  LossMaps maps;
  Tensor base;
  RowGroups parts;
};

/// Two views, 20 Gaussians of which some are far too large.
Scene make_scene(Device& device, int side = 40) {
  Scene scene;
  for (unsigned view = 0; view < 2; ++view) {
    scene.views.push_back({random_tensor(device, {side, side + 3, 3}, 10 + view, 0, 1).set_requires_gradient(),
                           random_tensor(device, {side, side + 3, 3}, 20 + view, 0, 1),
                           std::nullopt,
                           {0.1, 0.2, 0.3}});
  }
  scene.maps.position_offsets = random_tensor(device, {20, 3}, 30, -0.04, 0.04).set_requires_gradient();
  scene.maps.log_scales = random_tensor(device, {20, 3}, 31, -4, 1).set_requires_gradient();
  scene.maps.opacity_logits = random_tensor(device, {20}, 34, -8, 4).set_requires_gradient();
  scene.maps.divergence = random_tensor(device, {1}, 32, 1, 2).set_requires_gradient();
  scene.base = random_tensor(device, {20, 3}, 33, -4, -3);
  std::vector<int32_t> parts(20);
  for (int32_t i = 0; i < 20; ++i) parts[static_cast<size_t>(i)] = i % 3;
  scene.parts = group_rows(device, parts, 4);
  return scene;
}

Config without_lpips(double offset_limit = 0.1) {
  Config config;
  config.loss.lpips_weight = 0;
  config.net.kl_weight = 0.5;
  config.loss.drift_weight = 0.02;
  config.loss.scale_floor = 0.5;  // which some of the scene's log-scales lie below
  config.train.gradient_clip.offset_limit = offset_limit;
  return config;
}

double number(const Tensor& tensor) {
  return tensor.to_host<double>()[0];
}

}  // namespace

TEST_CASE("the total is the weighted sum of the terms, views averaged") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Scene scene = make_scene(device);
  const Loss loss(device, without_lpips(), scene.base, scene.parts);
  Tape tape(device, false);
  const auto values = loss.evaluate(tape, scene.views, scene.maps, 0).values();
  double photometric = 0;
  for (const LossView& view : scene.views)
    photometric += 0.5 * number(l1_ssim_loss(tape, view.image, view.target, 0.2));
  const double offset = number(mean_length(tape, scene.maps.position_offsets));
  const double drift = number(mean_drift(tape, scene.maps.position_offsets, scene.parts));
  const double excess = number(excess_scale(tape, scene.maps.log_scales, scene.base, 10));
  const double collapse = number(mean_shortfall(tape, scene.maps.opacity_logits, std::log(0.008 / 0.992))) +
                          number(mean_shortfall(tape, scene.maps.log_scales, std::log(0.5), scene.base));
  const double divergence = number(scene.maps.divergence);
  REQUIRE(offset < 0.1);
  REQUIRE(excess > 0);
  REQUIRE(collapse > 0);
  CHECK(values.size() == 7);
  CHECK(values.at("l1_ssim") == Approx(photometric).epsilon(1e-5));
  CHECK(values.at("offset") == Approx(offset));
  CHECK(values.at("drift") == Approx(drift));
  CHECK(values.at("scale") == Approx(excess));
  CHECK(values.at("collapse") == Approx(collapse));
  CHECK(values.at("kl") == Approx(divergence));
  CHECK(
      values.at("loss") ==
      Approx(photometric + 0.001 * offset + 0.02 * drift + excess + 0.01 * collapse + 0.5 * divergence).epsilon(1e-5));
}

TEST_CASE("offsets beyond the limit leave the offset term alone") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const Scene scene = make_scene(device);
  const auto total = [&](double limit) {
    Tensor(scene.maps.log_scales).clear_gradient();
    Tape tape(device);
    const LossTerms terms =
        Loss(device, without_lpips(limit), scene.base, scene.parts).evaluate(tape, scene.views, scene.maps, 0);
    const double value = number(terms.total), offset = number(terms.terms.at("offset"));
    tape.backward(terms.total);
    return std::pair{value, offset};
  };
  const auto [gated, offset] = total(0.001);
  CHECK(gated == Approx(0.001 * offset));
  for (double g : scene.maps.log_scales.gradient().to_host<double>()) CHECK(g == 0);
  for (double g : scene.views[0].image.gradient().to_host<double>()) REQUIRE(g == 0);
  CHECK(total(0).first > 0.1);  // 0: no limit
}

TEST_CASE("the gradient of the whole loss passes finite differences") {
  Device& device = test::device(KernelSet::Wide, Real::Double);
  const Scene scene = make_scene(device, 12);
  Config config = without_lpips();
  // At their usual weights the differences of a total near 1 would keep too few digits of these terms.
  config.loss.offset_weight = config.loss.drift_weight = config.loss.collapse_weight = 1;
  const Loss loss(device, config, scene.base, scene.parts);
  const auto function = [&](Tape& tape, const std::vector<Tensor>&) {
    return std::vector{loss.evaluate(tape, scene.views, scene.maps, 0).total};
  };
  // The views' gradients are small, which wants a wide step; short offsets are strongly curved, which wants a narrow
  // one.
  const std::vector<Tensor> pictures{scene.views[0].image, scene.views[1].image};
  CHECK(gradient_check(device, function, pictures, {.step = 1e-4, .samples_per_input = 16}) < 1e-6);
  const std::vector<Tensor> maps{scene.maps.position_offsets, scene.maps.log_scales, scene.maps.opacity_logits,
                                 scene.maps.divergence};
  CHECK(gradient_check(device, function, maps, {.step = 1e-5}) < 1e-6);
}

TEST_CASE("the perceptual term: region, scale, and every n-th step with n times its weight") {
  const std::string weights = data_path("weights/lpips_alex_v0.1.npz");
  if (weights.empty()) return;
  Device& device = test::device(KernelSet::Wide);
  Scene scene = make_scene(device, 64);
  Config config;
  config.train.gradient_clip.offset_limit = 0;
  config.loss.lpips_weights = weights;
  config.loss.lpips_every = 3;
  Tape tape(device, false);
  const auto total = [&](const Config& c, int64_t step) {
    return Loss(device, c, scene.base, scene.parts).evaluate(tape, scene.views, scene.maps, step).values();
  };

  const auto with = total(config, 3), between = total(config, 4);
  CHECK(between.count("lpips") == 0);
  CHECK(with.at("loss") - between.at("loss") == Approx(0.1 * 3 * with.at("lpips")).epsilon(1e-4));
  const Lpips lpips(device, load_lpips_layers(weights, LpipsNetwork::Alex));
  double expected = 0;
  for (const LossView& view : scene.views) expected += 0.5 * number(lpips.distance(tape, view.image, view.target));
  CHECK(with.at("lpips") == Approx(expected).epsilon(1e-5));

  // A region that hangs over the border has the background there, in both pictures.
  config.loss.lpips_region = LossRegion::Face;
  CHECK(total(config, 0).count("lpips") == 0);
  scene.views[1].region = Rectangle{-4, 30, 50, 50};
  const LossView& view = scene.views[1];
  const Tensor a = crop(tape, view.image, *view.region, view.background),
               b = crop(tape, view.target, *view.region, view.background);
  CHECK(total(config, 0).at("lpips") == Approx(0.5 * number(lpips.distance(tape, a, b))).epsilon(1e-5));

  config.loss.lpips_scale = 0.1;  // below the network's least size: brought to it
  const auto least = [&](const Tensor& t) { return resize(tape, t, lpips.smallest_side(), lpips.smallest_side()); };
  CHECK(total(config, 0).at("lpips") == Approx(0.5 * number(lpips.distance(tape, least(a), least(b)))).epsilon(1e-5));
}

TEST_CASE("a loss that wants LPIPS refuses to start without its weights") {
  Device& device = test::device(KernelSet::Wide);
  Config config;
  config.loss.lpips_weights = "/nowhere/lpips.npz";
  CHECK_THROWS_AS(Loss(device, config, Tensor::zeros(device, {1, 3}), {}), Error);
  const Loss allowed(device, without_lpips(), Tensor::zeros(device, {1, 3}), {});
  Tape tape(device);
  CHECK_THROWS_AS(allowed.evaluate(tape, {}, {}, 0), std::logic_error);
}

TEST_CASE("steps of loss and Adam repeat to the bit and allocate nothing after the first") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const std::string weights = data_path("weights/lpips_squeeze_v0.1.npz");
  Config config = without_lpips();
  if (!weights.empty()) {
    config.loss.lpips_weight = 0.1;
    config.loss.lpips_network = LpipsNetwork::Squeeze;
    config.loss.lpips_weights = weights;
  }
  size_t after_first = 0;
  const auto run = [&] {
    const Scene scene = make_scene(device);
    const Loss loss(device, config, scene.base, scene.parts);
    Optimiser adam(device);
    adam.add("image", scene.views[0].image);
    adam.add("log_scales", scene.maps.log_scales);
    for (int step = 0; step < 4; ++step) {
      Tape tape(device);
      tape.backward(loss.evaluate(tape, scene.views, scene.maps, step).total);
      adam.step({1e-2});
      // The others are no parameters here: Adam does not give their gradients back.
      for (Tensor other :
           {scene.views[1].image, scene.maps.position_offsets, scene.maps.opacity_logits, scene.maps.divergence})
        other.clear_gradient();
      const size_t allocations = device.memory_statistics().device_allocations;
      if (step == 0) after_first = allocations;
      CHECK(allocations == after_first);
    }
    CHECK(adam.counters().applied == 4);
    return std::pair{scene.views[0].image.to_host<float>(), scene.maps.log_scales.to_host<float>()};
  };
  const auto first = run();
  CHECK(first == run());
  CHECK(first.first != make_scene(device).views[0].image.to_host<float>());
}
