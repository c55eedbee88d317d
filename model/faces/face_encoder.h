#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

#include "host/device/device.h"
#include "host/io/onnx_model.h"
#include "model/net/expression_encoder_weights.h"

namespace degas {

/// Turns pictures of faces into codes.
struct FaceEncoder {
  int side = 0;                                                ///< of the RGB pictures it takes, pixels
  std::function<std::vector<float>(const Image8& face)> code;  ///< one thread at a time
  nlohmann::json description;                                  ///< of all that codes depend on, the file's bytes too
};

/// What settings of codes keep of a file that they depend on: its name, and a checksum of its bytes. Error naming it
/// when it cannot be read.
nlohmann::json file_description(const std::filesystem::path& path);

/// DPE's expression encoder on the device. Errors as load_expression_encoder throws them.
FaceEncoder make_dpe_encoder(Device& device, const std::filesystem::path& weights, const EncoderKeys& keys);

/// An ONNX network; all numbers of its output are the code. Errors as OnnxModel throws them.
FaceEncoder make_onnx_encoder(const std::filesystem::path& path, const OnnxInput& input, const std::string& output);

}  // namespace degas
