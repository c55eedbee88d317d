#include "model/net/expression_encoder_weights.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "host/error.h"
#include "host/io/npz.h"
#include "host/io/torch_archive.h"

namespace degas {
namespace {

std::string shape_text(const Shape& shape) {
  std::vector<std::string> sizes;
  for (const int64_t size : shape) sizes.push_back(size < 0 ? "any" : std::to_string(size));
  return fmt::format("({})", fmt::join(sizes, ", "));
}

/// One part's layers by their names below its path.
class Part {
 public:
  Part(const std::filesystem::path& file, const TorchTensors& tensors, const char* role, const std::string& path,
       const std::string& first_layer)
      : file_(file), tensors_(tensors) {
    path_ = path;
    const std::string wanted = key(first_layer, "weight");
    std::vector<std::string> found;
    for (const auto& [name, tensor] : tensors) {
      const bool ends = name.ends_with(wanted);
      if (ends && (name.size() == wanted.size() || name[name.size() - wanted.size() - 1] == '.')) found.push_back(name);
    }
    if (found.size() == 1) {
      path_ = found[0].substr(0, found[0].size() - wanted.size()) + path;
      return;
    }
    if (found.empty()) {
      throw Error::format(
          "{}: no tensor '{}', at which the encoder's {} begin; say where they lie by --keys {}=PATH; "
          "layers here: {}",
          file.string(), wanted, role, role, fmt::join(layers(), ", "));
    }
    throw Error::format("{}: the encoder's {} may be any of {}; choose by a longer path: --keys {}=PATH", file.string(),
                        role, fmt::join(found, ", "), role);
  }

  bool has(const std::string& layer) const { return tensors_.count(key(layer, "weight")) > 0; }

  /// The layer whose weight has this shape (-1: any size); its bias lies under the name `bias`, "" for none.
  EncoderLayer layer(const std::string& name, const Shape& shape, const std::string& bias) const {
    EncoderLayer layer;
    const std::string weight = key(name, "weight");
    layer.weight = numbers(weight);
    layer.shape = tensors_.at(weight).shape;
    bool fits = layer.shape.size() == shape.size();
    for (size_t axis = 0; fits && axis < shape.size(); ++axis) {
      fits = layer.shape[axis] > 0 && (shape[axis] < 0 || shape[axis] == layer.shape[axis]);
    }
    if (!fits) {
      throw Error::format("{}: '{}' has shape {}, expected {} after the layers before it", file_.string(), weight,
                          shape_text(layer.shape), shape_text(shape));
    }
    if (bias.empty()) return layer;
    layer.bias = numbers(key(bias, "bias"));
    if (static_cast<int64_t>(layer.bias.size()) != layer.shape[0]) {
      throw Error::format("{}: '{}' has {} numbers, expected {}, one an output of its layer", file_.string(),
                          key(bias, "bias"), layer.bias.size(), layer.shape[0]);
    }
    return layer;
  }
  /// Linear layers 0, 1, .. of which the first takes `inputs`.
  std::vector<EncoderLayer> linear_layers(int64_t inputs) const {
    std::vector<EncoderLayer> layers;
    for (int i = 0; has(std::to_string(i)); ++i) {
      layers.push_back(layer(std::to_string(i), {-1, inputs}, std::to_string(i)));
      inputs = layers.back().shape[0];
    }
    return layers;
  }

 private:
  /// A part that is a single layer has no name below its path.
  std::string key(const std::string& layer, const char* what) const {
    return layer.empty() ? fmt::format("{}.{}", path_, what) : fmt::format("{}.{}.{}", path_, layer, what);
  }
  std::vector<float> numbers(const std::string& key) const {
    const auto found = tensors_.find(key);
    if (found == tensors_.end()) throw Error::format("{}: no tensor '{}'", file_.string(), key);
    std::vector<float> values = found->second.floats();
    if (!std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); })) {
      throw Error::format("{}: '{}' holds numbers that are not finite; the file is damaged", file_.string(), key);
    }
    return values;
  }
  /// Paths of linear layers and bases, for errors: few enough to read.
  std::vector<std::string> layers() const {
    std::set<std::string> paths;
    for (const auto& [key, tensor] : tensors_) {
      if (!key.ends_with(".weight") || tensor.shape.size() != 2) continue;
      std::string path = key.substr(0, key.size() - std::string(".weight").size());
      const size_t dot = path.rfind('.');
      const bool numbered = dot != std::string::npos && path.find_first_not_of("0123456789", dot + 1) == path.npos;
      paths.insert(numbered ? path.substr(0, dot) : path);
    }
    constexpr size_t most = 12;
    std::vector<std::string> listed(paths.begin(), paths.end());
    if (listed.size() > most) {
      listed.resize(most);
      listed.push_back("..");
    }
    return listed;
  }

  const std::filesystem::path& file_;
  const TorchTensors& tensors_;
  std::string path_;
};

TorchTensors read_tensors(const std::filesystem::path& path) {
  if (path.extension() != ".npz") return read_torch_archive(path);
  TorchTensors tensors;
  const NpzFile file(path);
  for (const std::string& key : file.keys()) tensors[key] = file.read(key);
  return tensors;
}

}  // namespace

EncoderKeys parse_encoder_keys(const std::string& text) {
  EncoderKeys keys;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const size_t sign = part.find('=');
    const std::string role = part.substr(0, sign);
    std::string* path = role == "features"       ? &keys.features
                        : role == "coefficients" ? &keys.coefficients
                        : role == "basis"        ? &keys.basis
                        : role == "code"         ? &keys.code
                                                 : nullptr;
    if (!path || sign == std::string::npos || sign + 1 == part.size()) {
      throw Error::format("--keys {}: '{}' is no PART=PATH; parts are features, coefficients, basis and code", text,
                          part);
    }
    *path = part.substr(sign + 1);
  }
  return keys;
}

ExpressionEncoderWeights load_expression_encoder(const std::filesystem::path& path, const EncoderKeys& keys) {
  const TorchTensors tensors = read_tensors(path);
  ExpressionEncoderWeights weights;
  const Part features(path, tensors, "features", keys.features, "0.0");
  weights.input = features.layer("0.0", {-1, 3, 1, 1}, "0.1");
  int64_t channels = weights.input.shape[0];
  int number = 1;
  for (; features.has(fmt::format("{}.conv1.0", number)); ++number) {
    const std::string block = std::to_string(number);
    ExpressionEncoderWeights::Block& layers = weights.blocks.emplace_back();
    layers.first = features.layer(block + ".conv1.0", {channels, channels, 3, 3}, block + ".conv1.1");
    layers.second = features.layer(block + ".conv2.1", {-1, channels, 3, 3}, block + ".conv2.2");
    const int64_t outputs = layers.second.shape[0];
    layers.skip = features.layer(block + ".skip.1", {outputs, channels, 1, 1}, "");
    channels = outputs;
  }
  if (weights.blocks.empty() || weights.blocks.size() > 8) {
    throw Error::format("{}: {} blocks of the encoder's features under '{}', expected 1 to 8 (DPE has 6)",
                        path.string(), weights.blocks.size(), keys.features);
  }
  weights.output = features.layer(std::to_string(number), {-1, channels, 4, 4}, "");
  const int64_t size = weights.output.shape[0];
  weights.coefficients = Part(path, tensors, "coefficients", keys.coefficients, "0").linear_layers(size);
  const int64_t motions = weights.coefficients.back().shape[0];
  if (motions > size) {
    throw Error::format("{}: {} motion coefficients of {} features; there may not be more than features", path.string(),
                        motions, size);
  }
  weights.basis = Part(path, tensors, "basis", keys.basis, "").layer("", {size, motions}, "");
  weights.code = Part(path, tensors, "code", keys.code, "0").linear_layers(size);
  return weights;
}

}  // namespace degas
