#include "host/io/onnx_model.h"

#include "host/io/without_opencv/lacks_opencv.h"

namespace degas {

struct OnnxModel::Network {};

OnnxModel::OnnxModel(const std::filesystem::path& path, const OnnxInput&, const std::string&) {
  lacks_opencv(path.string() + ": ONNX networks cannot be run");
}
OnnxModel::~OnnxModel() = default;
std::vector<float> OnnxModel::operator()(const Image8&) {
  return {};
}
std::vector<float> OnnxModel::operator()(std::span<const float>, int) {
  return {};
}

}  // namespace degas
