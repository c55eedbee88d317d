#include "model/loss/lpips_weights.h"

#include <fmt/format.h>

#include <cstdlib>

#include "host/error.h"
#include "host/io/npz.h"

namespace degas {
namespace {

class WeightReader {
 public:
  explicit WeightReader(const std::filesystem::path& path) : file_(path) {}

  LpipsConvolution convolution(const std::string& name, const Shape& shape, int stride, int padding) const {
    return {shape, file_.read(name + ".weight", shape).floats(), file_.read(name + ".bias", {shape[0]}).floats(),
            stride, padding};
  }
  LpipsLayer convolution_layer(const std::string& name, const Shape& shape, int stride, int padding,
                               bool compared = true) {
    return {LpipsLayer::Kind::Convolution,
            {convolution(name, shape, stride, padding)},
            false,
            compared ? next_linear(shape[0]) : std::vector<float>{}};
  }
  /// SqueezeNet's block: squeeze by 1x1, then expand to 2 * `expand` channels by 1x1 and 3x3.
  LpipsLayer fire_layer(const std::string& name, int64_t inputs, int64_t squeeze, int64_t expand, bool compared) {
    return {LpipsLayer::Kind::Fire,
            {convolution(name + ".squeeze", {squeeze, inputs, 1, 1}, 1, 0),
             convolution(name + ".expand1x1", {expand, squeeze, 1, 1}, 1, 0),
             convolution(name + ".expand3x3", {expand, squeeze, 3, 3}, 1, 1)},
            false,
            compared ? next_linear(2 * expand) : std::vector<float>{}};
  }

 private:
  std::vector<float> next_linear(int64_t channels) {
    return file_.read("lin" + std::to_string(linear_++), {channels}).floats();
  }

  NpzFile file_;
  int linear_ = 0;
};

LpipsLayer pool(bool ceil_mode, int window = 3) {
  return {LpipsLayer::Kind::Pool, {}, ceil_mode, {}, window};
}

std::string file_name(LpipsNetwork network) {
  const char* names[] = {"alex", "squeeze", "vgg"};
  return fmt::format("lpips_{}_v0.1.npz", names[static_cast<int>(network)]);
}

/// Five stages of 3x3 convolutions; the last of each is compared, and a pool of 2x2 stands before the next.
std::vector<LpipsLayer> vgg_layers(WeightReader& reader) {
  std::vector<LpipsLayer> layers;
  int64_t inputs = 3;
  int place = 0;  // in torchvision's list, where each convolution is followed by its ReLU
  for (const std::vector<int64_t>& stage :
       std::vector<std::vector<int64_t>>{{64, 64}, {128, 128}, {256, 256, 256}, {512, 512, 512}, {512, 512, 512}}) {
    if (place > 0) layers.push_back(pool(false, 2)), ++place;
    for (size_t i = 0; i < stage.size(); ++i, place += 2) {
      layers.push_back(reader.convolution_layer(fmt::format("features.{}", place), {stage[i], inputs, 3, 3}, 1, 1,
                                                i + 1 == stage.size()));
      inputs = stage[i];
    }
  }
  return layers;
}

}  // namespace

std::vector<LpipsLayer> load_lpips_layers(const std::filesystem::path& path, LpipsNetwork network) {
  WeightReader reader(path);
  if (network == LpipsNetwork::Vgg) return vgg_layers(reader);
  std::vector<LpipsLayer> layers;
  if (network == LpipsNetwork::Alex) {
    layers.push_back(reader.convolution_layer("features.0", {64, 3, 11, 11}, 4, 2));
    layers.push_back(pool(false));
    layers.push_back(reader.convolution_layer("features.3", {192, 64, 5, 5}, 1, 2));
    layers.push_back(pool(false));
    layers.push_back(reader.convolution_layer("features.6", {384, 192, 3, 3}, 1, 1));
    layers.push_back(reader.convolution_layer("features.8", {256, 384, 3, 3}, 1, 1));
    layers.push_back(reader.convolution_layer("features.10", {256, 256, 3, 3}, 1, 1));
    return layers;
  }
  layers.push_back(reader.convolution_layer("features.0", {64, 3, 3, 3}, 2, 0));
  layers.push_back(pool(true));
  layers.push_back(reader.fire_layer("features.3", 64, 16, 64, false));
  layers.push_back(reader.fire_layer("features.4", 128, 16, 64, true));
  layers.push_back(pool(true));
  layers.push_back(reader.fire_layer("features.6", 128, 32, 128, false));
  layers.push_back(reader.fire_layer("features.7", 256, 32, 128, true));
  layers.push_back(pool(true));
  layers.push_back(reader.fire_layer("features.9", 256, 48, 192, true));
  layers.push_back(reader.fire_layer("features.10", 384, 48, 192, true));
  layers.push_back(reader.fire_layer("features.11", 384, 64, 256, true));
  layers.push_back(reader.fire_layer("features.12", 512, 64, 256, true));
  return layers;
}

std::filesystem::path lpips_weights_path(const std::string& configured, LpipsNetwork network) {
  const char* environment = std::getenv("DEGAS_LPIPS");
  const bool from_config = !configured.empty();
  std::filesystem::path path = from_config ? configured : environment ? environment : "";
  if (path.empty()) {
    throw Error::format(
        "LPIPS weights: none given; set loss.lpips_weights or the environment variable DEGAS_LPIPS to {} or its "
        "folder, or "
        "train without them by --set loss.lpips_weight=0",
        file_name(network));
  }
  if (std::filesystem::is_directory(path)) path /= file_name(network);
  if (!std::filesystem::exists(path)) {
    throw Error::format(
        "LPIPS weights: {} does not exist; correct {}, or train without them by --set loss.lpips_weight=0",
        path.string(), from_config ? "loss.lpips_weights" : "the environment variable DEGAS_LPIPS");
  }
  return path;
}

}  // namespace degas
