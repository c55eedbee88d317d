#include "tests/support/encoder_weights.h"

#include <cmath>

#include "host/random.h"

namespace degas::test {

std::vector<float> encoder_numbers(const std::string& name, const Shape& shape, double bound) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (const unsigned char c : name) hash = (hash ^ c) * 0x100000001b3u;
  Random random(Random(5).next() ^ hash);
  std::vector<float> values(static_cast<size_t>(element_count(shape)));
  for (float& value : values) value = static_cast<float>((2 * random.uniform() - 1) * bound);
  return values;
}

TorchTensors make_encoder_weights(const EncoderSizes& sizes) {
  TorchTensors tensors;
  const auto add = [&](const std::string& name, const Shape& shape, double bound) {
    tensors[name] = NpyArray::from(shape, encoder_numbers(name, shape, bound));
  };
  const auto weight = [&](const std::string& name, const Shape& shape) {
    add(name + ".weight", shape, std::sqrt(3.0));  // of unit variance
  };
  const auto bias = [&](const std::string& name, int64_t size) { add(name + ".bias", {size}, 0.1); };
  const auto linear = [&](const std::string& name, int64_t inputs, int64_t outputs) {
    weight(name, {outputs, inputs});
    bias(name, outputs);
  };
  const std::string convolutions = "enc.net_app.convs.";
  int64_t channels = sizes.channels[0];
  weight(convolutions + "0.0", {channels, 3, 1, 1});
  bias(convolutions + "0.1", channels);
  for (size_t i = 1; i < sizes.channels.size(); ++i) {
    const std::string block = convolutions + std::to_string(i) + ".";
    weight(block + "conv1.0", {channels, channels, 3, 3});
    bias(block + "conv1.1", channels);
    weight(block + "conv2.1", {sizes.channels[i], channels, 3, 3});
    bias(block + "conv2.2", sizes.channels[i]);
    weight(block + "skip.1", {sizes.channels[i], channels, 1, 1});
    channels = sizes.channels[i];
  }
  weight(convolutions + std::to_string(sizes.channels.size()), {sizes.features, channels, 4, 4});
  for (int i = 0; i < sizes.depth; ++i) {
    linear("mlp." + std::to_string(i), sizes.features, i + 1 == sizes.depth ? sizes.motions : sizes.features);
  }
  weight("dir", {sizes.features, sizes.motions});
  for (int i = 0; i < 3; ++i)
    linear("mlp_exp." + std::to_string(i), i == 0 ? sizes.features : sizes.codes, sizes.codes);
  return tensors;
}

}  // namespace degas::test
