#include "model/loss/lpips_weights.h"

#include <cstdlib>
#include <fstream>

#include "host/error.h"
#include "host/io/image.h"
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
