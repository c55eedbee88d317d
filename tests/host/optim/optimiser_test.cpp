#include "host/optim/optimiser.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "host/io/npz.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

void give_gradient(Tensor parameter, const std::vector<double>& values) {
  parameter.set_gradient(Tensor::from(parameter.device(), parameter.shape(), std::span<const double>(values)));
}

/// Sizes around every border of vectors, blocks and groups; three random steps.
std::vector<std::vector<float>> some_steps(Device& device) {
  Optimiser adam(device);
  std::vector<Tensor> tensors;
  unsigned seed = 1;
  for (int64_t size : {1, 15, 17, 4096, 4097, 100003}) {
    tensors.push_back(random_tensor(device, {size}, seed++));
    adam.add("parameter" + std::to_string(size), tensors.back());
  }
  for (int step = 0; step < 3; ++step) {
    for (Tensor& tensor : tensors) give_gradient(tensor, random_values(tensor.size(), seed++));
    adam.step({1e-3});
  }
  std::vector<std::vector<float>> values;
  for (const Tensor& tensor : tensors) values.push_back(tensor.to_host<float>());
  return values;
}

}  // namespace

TEST_CASE("Adam follows torch: clipping, two groups, an absent gradient, a skipped step") {
  const auto set = GENERATE(from_range(kernel_sets()));
  const auto real = GENERATE(Real::Float, Real::Double);
  Device& device = test::device(set, real);
  const NpzFile file(std::string(DEGAS_TEST_VECTORS) + "/optimiser.npz");
  const std::vector<double> rates = file.read("rates").doubles();
  const auto tensor_of = [&](const char* key) {
    const NpyArray array = file.read(key);
    return Tensor::from(device, array.shape, std::span<const double>(array.doubles()));
  };
  Tensor a = tensor_of("a"), b = tensor_of("b");
  Optimiser adam(device, {.beta2 = 0.99});
  adam.add("b", b, 1);
  adam.add("a", a, 0);
  CHECK(adam.parameters()[0].name == "a");
  for (size_t step = 0; step < rates.size(); ++step) {
    give_gradient(a, file.read("gradient_a" + std::to_string(step)).doubles());
    if (step != 2) give_gradient(b, file.read("gradient_b" + std::to_string(step)).doubles());
    adam.step({rates[step], 0.5 * rates[step]});
    CHECK_FALSE(a.has_gradient());
    if (step == 5) {
      CHECK(adam.counters().skipped_in_a_row == 1);
      CHECK(adam.counters().last_skipped.step == 5);
    } else {
      const double norm = file.read("norm" + std::to_string(step)).doubles()[0];
      CHECK(adam.counters().last_norm == Approx(norm).epsilon(1e-6));
    }
  }
  const double bar = real == Real::Double ? 1e-13 : 2e-6;
  CHECK(largest_difference(a.to_host<double>(), file.read("a_end").doubles()) < bar);
  CHECK(largest_difference(b.to_host<double>(), file.read("b_end").doubles()) < bar);
  CHECK(largest_difference(adam.parameters()[0].first_moment.to_host<double>(), file.read("a_moment").doubles()) < bar);
  CHECK(largest_difference(adam.parameters()[1].second_moment.to_host<double>(), file.read("b_moment2").doubles()) <
        bar);
  CHECK(adam.counters().applied == 8);
  CHECK(adam.counters().skipped == 1);
  CHECK(adam.counters().skipped_in_a_row == 0);
  CHECK(adam.progress().applied == std::vector<int32_t>{8, 7});
}

TEST_CASE("Rprop follows numpy: growing and shrinking steps, their bounds, gradients of zero") {
  const auto set = GENERATE(from_range(kernel_sets()));
  const auto real = GENERATE(Real::Float, Real::Double);
  Device& device = test::device(set, real);
  const NpzFile file(std::string(DEGAS_TEST_VECTORS) + "/optimiser.npz");
  const NpyArray start = file.read("c");
  Tensor c = Tensor::from(device, start.shape, std::span<const double>(start.doubles()));
  Tensor other = random_tensor(device, {3}, 1);
  Optimiser optimiser(device);
  optimiser.add("c", c, 1, UpdateRule::Rprop);
  optimiser.add("other", other);
  for (int step = 0; step < 12; ++step) {
    give_gradient(c, file.read("gradient_c" + std::to_string(step)).doubles());
    optimiser.step({0.1, 1e-3});
    // Skipped, or without a gradient for it: it stays as it is.
    give_gradient(c, std::vector<double>(1031, NAN));
    optimiser.step({0.1, 1e-3});
    give_gradient(other, {1, 2, 3});
    optimiser.step({0.1, 1e-3});
  }
  const double bar = real == Real::Double ? 1e-13 : 2e-6;
  CHECK(largest_difference(c.to_host<double>(), file.read("c_end").doubles()) < bar);
  const std::vector<double> steps = optimiser.parameters()[0].second_moment.to_host<double>();
  CHECK(largest_difference(steps, file.read("c_step").doubles()) < 10 * bar);
  CHECK(*std::min_element(steps.begin(), steps.end()) == Approx(0.05));
  CHECK(*std::max_element(steps.begin(), steps.end()) == Approx(10));
}

TEST_CASE("a step with a NaN, an infinity or an overflowing norm changes nothing and is counted") {
  const auto set = GENERATE(from_range(kernel_sets()));
  Device& device = test::device(set);
  Tensor good = random_tensor(device, {33}, 1), bad = random_tensor(device, {4097}, 2);
  Optimiser adam(device);
  adam.add("good", good);
  adam.add("bad", bad);
  give_gradient(good, random_values(33, 3));
  give_gradient(bad, random_values(4097, 4));
  double squares = 0;
  for (const Tensor& tensor : {good, bad}) {
    for (double value : tensor.gradient().to_host<double>()) squares += value * value;
  }
  adam.step({0.1});
  CHECK(adam.counters().last_skipped.step == -1);
  CHECK(adam.counters().last_norm == Approx(std::sqrt(squares)).epsilon(1e-6));
  const auto good_before = good.to_host<float>(), bad_before = bad.to_host<float>();
  const auto moment_before = adam.parameters()[1].second_moment.to_host<float>();
  int skipped = 0;
  for (const double poison : {std::nan(""), -std::numeric_limits<double>::infinity(), 1e30}) {
    for (const size_t place : {0, 4095, 4096}) {
      std::vector<double> values = random_values(4097, 5);
      values[place] = poison;
      give_gradient(good, random_values(33, 6));
      give_gradient(bad, values);
      adam.step({0.1});
      CHECK(adam.counters().skipped_in_a_row == ++skipped);
      CHECK(adam.counters().last_skipped.step == skipped);
      CHECK(adam.counters().last_skipped.parameter == "bad");
    }
  }
  CHECK(good.to_host<float>() == good_before);
  CHECK(bad.to_host<float>() == bad_before);
  CHECK(adam.parameters()[1].second_moment.to_host<float>() == moment_before);
  CHECK(adam.counters().applied == 1);
  CHECK(adam.counters().skipped == 9);
}

TEST_CASE("a skipped step names the first gradient that is not finite, or the largest where only the sum overflows") {
  const auto set = GENERATE(from_range(kernel_sets()));
  Device& device = test::device(set);
  Optimiser adam(device);
  std::vector<Tensor> tensors;
  for (int i = 0; i < 20; ++i) {  // more than a batch of the kernels
    tensors.push_back(random_tensor(device, {i % 3 == 0 ? 9000 : 5}, 1));
    adam.add(fmt::format("parameter{:02}", i), tensors.back());
  }
  const auto culprit = [&](const std::vector<std::pair<size_t, double>>& poison) {
    for (size_t i = 0; i < tensors.size(); ++i) {
      if (i == 4) continue;  // has no gradient
      std::vector<double> values(static_cast<size_t>(tensors[i].size()), 1e-3);
      for (const auto& [which, value] : poison) {
        if (which == i) values.back() = value;
      }
      give_gradient(tensors[i], values);
    }
    adam.step({0.1});
    return adam.counters().last_skipped.parameter;
  };
  CHECK(culprit({}) == "");
  CHECK(culprit({{5, std::nan("")}, {18, std::nan("")}}) == "parameter05");
  CHECK(culprit({{18, std::numeric_limits<double>::infinity()}}) == "parameter18");
  CHECK(culprit({{3, 1.2e19}, {6, 1.5e19}, {9, 1.3e19}}) == "parameter06");  // each square is finite
  CHECK(culprit({}) == "parameter06");                                       // of the last one that was skipped
  CHECK(adam.counters().last_skipped.step == 3);
  CHECK(adam.counters().applied == 2);
}

TEST_CASE("a step whose norm is a spike changes nothing and is counted; what rises slowly or stays is none",
          "[large]") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  Tensor small = random_tensor(device, {33}, 1), large = random_tensor(device, {9000}, 2);
  Optimiser adam(device, {.spike_limit = 10});
  adam.add("large", large);
  adam.add("small", small);
  const auto step = [&](double norm) {
    std::vector<double> values(9000, 0.0);
    values[100] = values[4500] = values[8500] = norm * std::sqrt(0.2);  // each less than the other's, but three
    give_gradient(large, values);
    values.assign(33, 0.0);
    values[7] = norm * std::sqrt(0.4);
    give_gradient(small, values);
    adam.step({0.01});
  };
  double largest = 0;  // of late, by the rule
  for (int i = 0; i < 20; ++i) {
    const double norm = i == 0 ? 0 : i == 3 ? 50 : i < 3 ? 0.1 : 1;  // what so few steps have not shown is no spike
    step(norm);
    largest = std::max(norm, largest * std::exp(-0.01));
  }
  CHECK(adam.counters().applied == 20);

  const auto before = large.to_host<float>();
  step(10.1 * largest);
  CHECK(large.to_host<float>() == before);
  CHECK(adam.counters().skipped == 1);
  CHECK(adam.counters().last_skipped.step == 20);
  CHECK(adam.counters().last_skipped.parameter == "large");
  CHECK(adam.counters().last_skipped.norm == Approx(10.1 * largest).epsilon(1e-5));
  CHECK(adam.counters().last_skipped.largest_norm == Approx(largest).epsilon(1e-5));
  step(19.9 * largest);  // a spike has doubled what is accepted
  CHECK(large.to_host<float>() != before);
  CHECK(adam.counters().skipped_in_a_row == 0);

  const auto skipped_in = [&](const std::vector<double>& norms) {
    const int skipped = adam.counters().skipped;
    for (const double norm : norms) step(norm);
    return adam.counters().skipped - skipped;
  };
  // Gradients that fall to a thousandth for long, as while one term of the loss stands alone, and come back.
  CHECK(skipped_in(std::vector<double>(2000, 1e-3)) == 0);
  CHECK(skipped_in(std::vector<double>(50, 1.0)) == 7);  // until 2^7 times 10 times 0.001 is more
  CHECK(skipped_in({1e9}) == 1);
  CHECK(skipped_in(std::vector<double>(50, 1.0)) == 0);
}

TEST_CASE("Adam gives the same bits each time, and close ones by both kernel sets") {
  const auto wide = some_steps(test::device(KernelSet::Wide)), gpu = some_steps(test::device(KernelSet::Gpu));
  CHECK(wide == some_steps(test::device(KernelSet::Wide)));
  CHECK(gpu == some_steps(test::device(KernelSet::Gpu)));
  for (size_t i = 0; i < wide.size(); ++i) {
    const std::vector<double> a(wide[i].begin(), wide[i].end()), b(gpu[i].begin(), gpu[i].end());
    CHECK(largest_difference(a, b) < 1e-6);
  }
}

TEST_CASE("Adam restored from its moments and progress goes on with the same bits") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const std::vector<double> start = random_values(100, 1);
  const auto run = [&](bool interrupted) {
    Tensor value = Tensor::from(device, {100}, std::span<const double>(start));
    const OptimiserOptions options{.spike_limit = 5};
    Optimiser first(device, options), second(device, options);
    first.add("p", value);
    second.add("p", value);
    Optimiser* adam = &first;
    for (int step = 0; step < 60; ++step) {
      if (interrupted && step == 30) {
        const Optimiser::Parameter& from = first.parameters()[0];
        Tensor(second.parameters()[0].first_moment).upload(std::span<const float>(from.first_moment.to_host<float>()));
        Tensor(second.parameters()[0].second_moment)
            .upload(std::span<const float>(from.second_moment.to_host<float>()));
        second.restore(first.progress());
        adam = &second;
      }
      const double size = step == 25 || step == 40 ? 0.5 : 0.01;  // two spikes
      give_gradient(value, random_values(100, 10 + step, -size, size));
      adam->step({1e-2});
    }
    CHECK(adam->counters().applied + adam->counters().skipped == 60);
    CHECK(adam->counters().skipped == 2);
    return value.to_host<float>();
  };
  CHECK(run(false) == run(true));
}

TEST_CASE("Adam refuses a taken name, a late parameter and a group without a rate") {
  Device& device = test::device(KernelSet::Wide);
  Tensor value = random_tensor(device, {3}, 1);
  Optimiser adam(device);
  adam.add("p", value, 1);
  CHECK_THROWS_AS(adam.add("p", value), std::logic_error);
  CHECK_THROWS_AS(adam.step({0.1}), std::logic_error);
  CHECK_THROWS_AS(adam.restore({{}, {1, 2}, {}}), std::logic_error);
  CHECK_THROWS_AS(adam.add("q", value), std::logic_error);
}

TEST_CASE("plain clipping scales to the bound itself; 0 switches it off") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const auto moment_after = [&](OptimiserOptions options) {
    Tensor value = random_tensor(device, {2}, 1);
    Optimiser adam(device, options);
    adam.add("p", value);
    give_gradient(value, {30, 40});
    adam.step({0.1});
    return adam.parameters()[0].first_moment.to_host<double>();
  };
  CHECK(largest_difference(moment_after({.clip_above = 2, .clip_to = 2}), {0.12, 0.16}) < 1e-6);
  CHECK(largest_difference(moment_after({.clip_above = 0}), {3, 4}) < 1e-6);
  CHECK(largest_difference(moment_after({}), {0.006, 0.008}) < 1e-6);
}

TEST_CASE("parameters that share launches get the bits that each gets alone") {
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const OptimiserOptions options{.clip_above = 0};  // whose norm is over all of them
  std::vector<int64_t> sizes;
  for (int i = 0; i < 17; ++i) sizes.push_back(1 + 2 * i);  // more than a launch takes
  for (int i = 0; i < 3; ++i) sizes.push_back(6 * 4096);    // of several blocks
  Optimiser together(device, options);
  std::vector<std::unique_ptr<Optimiser>> alone;
  std::vector<Tensor> shared, single;
  for (size_t i = 0; i < sizes.size(); ++i) {
    const auto seed = static_cast<unsigned>(i);
    shared.push_back(random_tensor(device, {sizes[i]}, seed));
    single.push_back(random_tensor(device, {sizes[i]}, seed));
    const int group = i % 7 == 3 ? 1 : 0;
    together.add(fmt::format("{:02}", i), shared.back(), group);
    alone.push_back(std::make_unique<Optimiser>(device, options));
    alone.back()->add("it", single.back(), group);
  }
  for (unsigned step = 0; step < 4; ++step) {
    for (size_t i = 0; i < sizes.size(); ++i) {
      if (step % 2 == 1 && i % 3 == 0) continue;  // has no gradient
      const std::vector<double> gradient = random_values(sizes[i], 100 * step + static_cast<unsigned>(i));
      give_gradient(shared[i], gradient);
      give_gradient(single[i], gradient);
      alone[i]->step({1e-3, 2e-3});
    }
    together.step({1e-3, 2e-3});
  }
  for (size_t i = 0; i < sizes.size(); ++i) {
    CAPTURE(i);
    const bool same = shared[i].to_host<float>() == single[i].to_host<float>();
    CHECK(same);
  }
}
