#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <span>
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
  /// The same of a square of any side, values 0..255, brought to the input's side by linear interpolation between pixel
  /// centres (torch's interpolate without antialiasing, by which FID is defined).
  std::vector<float> operator()(std::span<const float> square, int side);

 private:
  struct Network;
  /// picture: RGB values 0..255 of the input's side.
  std::vector<float> run(std::span<const float> picture, const std::string& output);

  std::filesystem::path path_;
  OnnxInput input_;
  std::string output_;
  std::unique_ptr<Network> network_;
};

}  // namespace degas
