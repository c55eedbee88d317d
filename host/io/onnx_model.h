#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "host/io/image.h"

namespace degas {

/// What an ONNX network is given: (1, 3, side, side) RGB, (value - mean) * scale of the picture's 0..255 by channel.
struct OnnxInput {
  int side = 256;
  std::array<double, 3> mean = {0, 0, 0}, scale = {1 / 255.0, 1 / 255.0, 1 / 255.0};
};

/// A network from pictures to numbers in an ONNX file, run by OpenCV on the CPU. One thread at a time.
class OnnxModel {
 public:
  /// output: name of the output that is wanted; empty: the largest one. Error naming the file when it is missing, not
  /// read by OpenCV, does not take the input, or has no such output.
  OnnxModel(const std::filesystem::path& path, const OnnxInput& input, const std::string& output = "");
  ~OnnxModel();

  /// An RGB picture of side x side. Gives all numbers of the output in a row.
  std::vector<float> operator()(const Image8& picture);

 private:
  struct Network;
  std::vector<float> run(const Image8& picture, const std::string& output);

  std::filesystem::path path_;
  OnnxInput input_;
  std::string output_;
  std::unique_ptr<Network> network_;
};

}  // namespace degas
