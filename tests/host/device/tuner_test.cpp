#include "host/device/tuner.h"

#include <fstream>

#include "host/device/program.h"
#include "host/error.h"
#include "host/ops/pointwise.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

/// Some products, taken `times` times over; `wrong` makes another number of one, `part` leaves some unwritten.
struct Products {
  Device& device;
  int prepared = 0;
  std::vector<Parameters> candidates;

  Parameters choose(Tuner& tuner, const std::string& shape = "1") {
    return tuner.choose({"pointwise/multiply", {"pointwise"}}, shape, [&] {
      return Tunable{candidates, [&] { return trial(); }};
    });
  }
  Trial trial() {
    ++prepared;
    const Shape shape = {1 << 18};
    const Tensor a = random_tensor(device, shape, 1), output(device, shape);
    std::vector<float> changed = a.to_host<float>();
    changed[12345] += 0.01f;
    const Tensor b = Tensor::from(device, shape, std::span<const float>(changed));
    return {&output.memory(), output.size(), [=, this](const Parameters& p) {
              if (p.contains("refused")) throw std::logic_error("CL_INVALID_WORK_GROUP_SIZE\nand more");
              const int64_t count = p.contains("part") ? output.size() - 64 : output.size();
              for (int i = 0; i < p.at("times"); ++i) {
                device.kernel("pointwise", "multiply")
                    .launch(device.pointwise_global(count), device.pointwise_local(), a, p.contains("wrong") ? b : a,
                            output, count);
              }
            }};
  }
};

/// Counts instead of timing, which other programs on the machine would disturb.
class CountingTuner : public Tuner {
 public:
  using Tuner::Tuner;
  double measure(const Trial&, const Parameters& parameters, int) override { return parameters.at("times"); }
};

Parameters times(int count, const std::string& fault = {}) {
  Parameters parameters = {{"times", count}};
  if (!fault.empty()) parameters[fault] = 1;
  return parameters;
}

}  // namespace

TEST_CASE("a launch whose default leaves numbers unwritten is not tuned") {
  const TemporaryFolder folder;
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  Products products{device, 0, {times(2, "part"), times(1)}};
  CountingTuner tuner(device, TuneMode::Full, folder / "tuning.json");
  CHECK(products.choose(tuner) == times(2, "part"));
  CHECK(TuningTable(folder / "tuning.json").size() == 0);
}

TEST_CASE("the fastest candidate is chosen, and the default where none is clearly faster") {
  const TemporaryFolder folder;
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  Products products{device, 0, {times(12), times(6), times(1), times(3)}};
  CountingTuner tuner(device, TuneMode::Fast, folder / "tuning.json");
  CHECK(tuner.summary().empty());
  CHECK(products.choose(tuner) == times(1));
  products.candidates = {times(1), times(6)};
  CHECK(products.choose(tuner, "2") == times(1));
  CHECK(products.prepared == 2);
  CHECK_THAT(tuner.summary(), Catch::StartsWith("2 launches tuned in") && Catch::Contains("0 known already"));
}

TEST_CASE("a candidate that is wrong, leaves numbers unwritten or is refused by the device is not chosen") {
  const TemporaryFolder folder;
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const std::string fault = GENERATE("wrong", "part", "refused");
  Products products{device, 0, {times(40), times(1, fault), times(4)}};
  CountingTuner tuner(device, TuneMode::Full, folder / "tuning.json");
  CHECK(products.choose(tuner) == times(4));
}

TEST_CASE("what is known is not tried again; --tune full looks anew at what fast has found") {
  const TemporaryFolder folder;
  Device& device = test::device(KernelSet::Wide);
  Products products{device, 0, {times(4), times(1)}};
  const auto chosen_by = [&](TuneMode mode) {
    CountingTuner tuner(device, mode, folder / "tuning.json");
    CHECK(products.choose(tuner) == times(1));
    CHECK(products.choose(tuner) == times(1));
    return products.prepared;
  };
  CHECK(chosen_by(TuneMode::Fast) == 1);
  CHECK(chosen_by(TuneMode::Fast) == 1);
  CHECK(chosen_by(TuneMode::Full) == 2);
  CHECK(chosen_by(TuneMode::Full) == 2);
  CHECK(chosen_by(TuneMode::Fast) == 2);
  // A choice that is no candidate any more is not taken.
  products.candidates = {times(6), times(2)};
  CountingTuner tuner(device, TuneMode::Fast, folder / "tuning.json");
  CHECK(products.choose(tuner) == times(2));
}

TEST_CASE("another kernel source, parameter set or precision is tuned for itself") {
  const TemporaryFolder folder;
  for (const auto& [name, text] : embedded_kernels()) {
    std::filesystem::create_directories((folder / name).parent_path());
    std::ofstream(folder / name) << text << (name == "pointwise.cl" ? "// changed\n" : "");
  }
  DeviceOptions options;
  options.kernel_folder = folder.path();
  auto& changed = *new Device(options);  // never destroyed: see test_devices.cpp
  int prepared = 0;
  for (Device* device : {&test::device(KernelSet::Wide), &test::device(KernelSet::Gpu),
                         &test::device(KernelSet::Wide, Real::Double), &changed}) {
    Products products{*device, 0, {times(4), times(1)}};
    CountingTuner tuner(*device, TuneMode::Fast, folder / "tuning.json");
    products.choose(tuner);
    prepared += products.prepared;
  }
  CHECK(prepared == 4);
}

TEST_CASE("a run's record goes before the cache, and keeps what the run was made with") {
  const TemporaryFolder folder;
  Device& device = test::device(KernelSet::Wide);
  Products products{device, 0, {times(4), times(1), times(2)}};
  {
    CountingTuner tuner(device, TuneMode::Fast, folder / "tuning.json");
    tuner.record_in(folder / "run.json");
    CHECK(products.choose(tuner) == times(1));
  }
  // The cache forgets, then learns something else.
  std::filesystem::remove(folder / "tuning.json");
  products.candidates = {times(4), times(2)};
  CountingTuner elsewhere(device, TuneMode::Full, folder / "tuning.json");
  CHECK(products.choose(elsewhere) == times(2));
  products.candidates = {times(4), times(1), times(2)};
  CountingTuner resumed(device, TuneMode::Full, folder / "tuning.json");
  resumed.record_in(folder / "run.json");
  CHECK(products.choose(resumed) == times(1));
  CHECK(products.prepared == 2);
  CHECK(TuningTable(folder / "run.json").mode() == TuneMode::Fast);
}

TEST_CASE("where the trial's arrays find no room the default is taken, and nothing is noted but in the run") {
  const TemporaryFolder folder;
  Device& device = test::device(KernelSet::Wide);
  CountingTuner tuner(device, TuneMode::Fast, folder / "tuning.json");
  tuner.record_in(folder / "run.json");
  const std::function<Trial()> no_room = []() -> Trial { throw Error("device out of memory"); };
  const Parameters chosen = tuner.choose({"pointwise/multiply", {"pointwise"}}, "1", [&] {
    return Tunable{{times(4), times(1)}, no_room};
  });
  CHECK(chosen == times(4));
  CHECK(TuningTable(folder / "tuning.json").size() == 0);
  CHECK(TuningTable(folder / "run.json").size() == 1);
}

TEST_CASE("by the clock, too, the least work is the fastest") {
  const TemporaryFolder folder;
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  Products products{device, 0, {times(100), times(1)}};
  Tuner tuner(device, TuneMode::Fast, folder / "tuning.json");
  CHECK(products.choose(tuner) == times(1));
}
