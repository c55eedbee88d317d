#include "model/faces/face_encoder.h"

#include <memory>

#include "host/io/file_bytes.h"
#include "model/data/identity.h"

namespace degas {

nlohmann::json file_description(const std::filesystem::path& path) {
  const std::vector<std::byte> bytes = read_file_bytes(path);
  Identity identity;
  identity.add({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return {{"file", path.filename().string()}, {"checksum", identity.text()}};
}

FaceEncoder make_dpe_encoder(Device& device, const std::filesystem::path& weights, const EncoderKeys& keys) {
  const auto network = std::make_shared<ExpressionEncoder>(device, load_expression_encoder(weights, keys));
  const int side = network->image_side();
  FaceEncoder encoder;
  encoder.side = side;
  encoder.description = {{"weights", file_description(weights)},
                         {"keys", {keys.features, keys.coefficients, keys.basis, keys.code}}};
  encoder.code = [&device, network, side](const Image8& face) {
    std::vector<float> values(face.pixels.size());
    for (size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(face.pixels[i]) / 127.5f - 1;
    Tape tape(device, false);
    return (*network)(tape, Tensor::from(device, {1, side, side, 3}, std::span<const float>(values))).to_host<float>();
  };
  return encoder;
}

FaceEncoder make_onnx_encoder(const std::filesystem::path& path, const OnnxInput& input, const std::string& output) {
  const auto model = std::make_shared<OnnxModel>(path, input, output);
  FaceEncoder encoder;
  encoder.side = input.side;
  encoder.description = {{"onnx", file_description(path)},
                         {"input", input.side},
                         {"mean", input.mean},
                         {"scale", input.scale},
                         {"output", output}};
  encoder.code = [model](const Image8& face) { return (*model)(face); };
  return encoder;
}

}  // namespace degas
