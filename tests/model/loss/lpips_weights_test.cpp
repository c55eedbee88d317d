#include "model/loss/lpips_weights.h"

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "host/error.h"
#include "host/io/image.h"
#include "host/io/npz.h"
#include "model/net/parameter_store.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;

namespace {

Tensor picture(Device& device, const std::string& name) {
  const Image8 image = read_image(data_path("weights/lpips_reference_images/" + name));
  std::vector<float> values;
  for (const uint8_t byte : image.pixels) values.push_back(byte / 255.0f);
  return Tensor::from(device, {image.height, image.width, 3}, std::span<const float>(values));
}

/// Sets the environment variable for one test.
class Environment {
 public:
  explicit Environment(const char* value) {
    if (const char* before = std::getenv("DEGAS_LPIPS")) kept_ = before;
    value ? setenv("DEGAS_LPIPS", value, 1) : unsetenv("DEGAS_LPIPS");
  }
  ~Environment() { kept_.empty() ? unsetenv("DEGAS_LPIPS") : setenv("DEGAS_LPIPS", kept_.c_str(), 1); }

 private:
  std::string kept_;
};

}  // namespace

TEST_CASE("LPIPS of the reference images is the published distance") {
  const std::string weights = data_path("weights/lpips_alex_v0.1.npz");
  if (weights.empty()) return;
  const auto [network, near, far] = GENERATE(table<LpipsNetwork, double, double>(
      {{LpipsNetwork::Alex, 0.1376, 0.7219}, {LpipsNetwork::Squeeze, 0.1479, 0.7110}}));
  Device& device = test::device(GENERATE(from_range(kernel_sets())));
  const auto path = lpips_weights_path(std::filesystem::path(weights).parent_path().string(), network);
  const Lpips lpips(device, load_lpips_layers(path, network));
  const Tensor reference = picture(device, "ex_ref.png");
  Tape tape(device, false);
  const auto distance = [&](const char* name) {
    return lpips.distance(tape, reference, picture(device, name)).to_host<double>()[0];
  };
  CHECK(distance("ex_p0.png") == Approx(far).margin(1e-4));
  CHECK(distance("ex_p1.png") == Approx(near).margin(1e-4));
}

TEST_CASE("LPIPS by VGG16 equals PyTorch's, with weights of VGG's shapes") {
  // As in tests/vectors/make_lpips_vgg.py, which printed the number below.
  constexpr uint64_t seed = 5;
  constexpr int height = 35, width = 48;
  Device& device = test::device(KernelSet::Wide);
  const auto drawn = [&](const std::string& name, const Shape& shape, double bound) {
    return ParameterStore(device, seed).create_uniform(name, shape, bound).to_host<float>();
  };
  std::map<std::string, NpyArray> arrays;
  const std::vector<std::vector<int64_t>> stages = {
      {64, 64}, {128, 128}, {256, 256, 256}, {512, 512, 512}, {512, 512, 512}};
  int64_t inputs = 3;
  int place = 0;
  for (size_t stage = 0; stage < stages.size(); ++stage) {
    for (const int64_t outputs : stages[stage]) {
      const std::string name = "features." + std::to_string(place);
      const Shape shape{outputs, inputs, 3, 3};
      arrays[name + ".weight"] =
          NpyArray::from(shape, std::span<const float>(drawn(name + ".weight", shape, std::sqrt(6.0 / (9 * inputs)))));
      arrays[name + ".bias"] = NpyArray::from({outputs}, std::span<const float>(drawn(name + ".bias", {outputs}, 0.1)));
      inputs = outputs;
      place += 2;
    }
    ++place;  // the pool
    const std::string name = "lin" + std::to_string(stage);
    std::vector<float> linear = drawn(name, {inputs}, 1);
    for (float& value : linear) value += 1;
    arrays[name] = NpyArray::from({inputs}, std::span<const float>(linear));
  }
  const TemporaryFolder folder;
  write_npz(folder / "lpips_vgg_v0.1.npz", arrays);
  const Lpips lpips(
      device, load_lpips_layers(lpips_weights_path(folder.path().string(), LpipsNetwork::Vgg), LpipsNetwork::Vgg));
  const auto drawn_picture = [&](const std::string& name) {
    std::vector<float> values = drawn(name, {height, width, 3}, 1);
    for (float& value : values) value = 0.5f + 0.5f * value;
    return Tensor::from(device, {height, width, 3}, std::span<const float>(values));
  };
  Tape tape(device, false);
  CHECK(lpips.distance(tape, drawn_picture("image"), drawn_picture("target")).to_host<double>()[0] ==
        Approx(1.3601687743).margin(1e-5));
  arrays.erase("features.28.bias");
  write_npz(folder / "lpips_vgg_v0.1.npz", arrays);
  CHECK_THROWS_WITH(load_lpips_layers(folder / "lpips_vgg_v0.1.npz", LpipsNetwork::Vgg),
                    Catch::Contains("lpips_vgg_v0.1.npz") && Catch::Contains("features.28.bias"));
}

TEST_CASE("missing LPIPS weights are an error that names the remedy") {
  using Catch::Contains;
  {
    const Environment none(nullptr);
    CHECK_THROWS_WITH(lpips_weights_path("", LpipsNetwork::Alex),
                      Contains("loss.lpips_weights") && Contains("DEGAS_LPIPS") && Contains("lpips_alex_v0.1.npz"));
    CHECK_THROWS_WITH(lpips_weights_path("/nowhere/x.npz", LpipsNetwork::Alex),
                      Contains("/nowhere/x.npz") && Contains("loss.lpips_weight=0"));
  }
  const auto folder = std::filesystem::temp_directory_path() / "degas_lpips_weights_test";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "lpips_squeeze_v0.1.npz") << "not a zip";
  {
    const Environment set(folder.c_str());
    const auto path = lpips_weights_path("", LpipsNetwork::Squeeze);
    CHECK(path == folder / "lpips_squeeze_v0.1.npz");
    CHECK_THROWS_AS(load_lpips_layers(path, LpipsNetwork::Squeeze), Error);
    CHECK_THROWS_WITH(lpips_weights_path("", LpipsNetwork::Alex), Contains("DEGAS_LPIPS"));
  }
  std::filesystem::remove_all(folder);
}
