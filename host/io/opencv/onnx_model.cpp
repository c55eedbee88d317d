#include "host/io/onnx_model.h"

#include <fmt/ranges.h>

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>

#include "host/error.h"
#include "host/io/opencv/onnx_tensors.h"

namespace degas {
namespace {

/// Damaged networks also end in what OpenCV does not foresee, std::length_error for one. Its own reasons run over
/// several lines.
std::string reason(const std::exception& error) {
  const auto* own = dynamic_cast<const cv::Exception*>(&error);
  const std::string text = own ? own->err : error.what();
  return text.substr(0, text.find('\n'));
}

}  // namespace

struct OnnxModel::Network {
  cv::dnn::Net net;
};

OnnxModel::OnnxModel(const std::filesystem::path& path, const OnnxInput& input, const std::string& output)
    : path_(path), input_(input), output_(output), network_(std::make_unique<Network>()) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  if (!std::filesystem::is_regular_file(path)) throw Error::format("{}: no such file", path.string());
  check_onnx_tensors(path);
  std::vector<std::string> names;
  try {
    network_->net = cv::dnn::readNetFromONNX(path.string());
    names = network_->net.getUnconnectedOutLayersNames();
  } catch (const std::exception& error) {
    throw Error::format("{}: is no ONNX network that OpenCV {} reads: {}", path.string(), CV_VERSION, reason(error));
  }
  const std::vector<float> empty(static_cast<size_t>(input.side) * static_cast<size_t>(input.side) * 3);
  size_t largest = 0;
  for (const std::string& name : names) {
    if (!output.empty() && name != output) continue;
    const size_t size = run(empty, name).size();
    if (size > largest) output_ = name;
    largest = std::max(largest, size);
  }
  if (largest == 0)
    throw Error::format("{}: no output '{}'; outputs here: {}", path.string(), output, fmt::join(names, ", "));
}

OnnxModel::~OnnxModel() = default;

std::vector<float> OnnxModel::run(std::span<const float> picture, const std::string& output) {
  const int sizes[] = {1, 3, input_.side, input_.side};
  cv::Mat blob(4, sizes, CV_32F);
  const size_t pixels = static_cast<size_t>(input_.side) * static_cast<size_t>(input_.side);
  for (size_t channel = 0; channel < 3; ++channel) {
    float* plane = blob.ptr<float>(0, static_cast<int>(channel));
    for (size_t i = 0; i < pixels; ++i) {
      plane[i] = static_cast<float>((picture[3 * i + channel] - input_.mean[channel]) * input_.scale[channel]);
    }
  }
  cv::Mat result;
  try {
    network_->net.setInput(blob);
    result = network_->net.forward(output);
    if (!result.isContinuous()) result = result.clone();
  } catch (const std::exception& error) {
    throw Error::format("{}: fails on a picture of {}x{}: {}; is --input right?", path_.string(), input_.side,
                        input_.side, reason(error));
  }
  if (result.depth() != CV_32F) throw Error::format("{}: output '{}' is not of float32", path_.string(), output);
  return {result.ptr<float>(), result.ptr<float>() + result.total()};
}

std::vector<float> OnnxModel::operator()(const Image8& picture) {
  if (picture.width != input_.side || picture.height != input_.side || picture.channels != 3) {
    throw std::logic_error("[onnx model] a picture of another size than the input");
  }
  return run(std::vector<float>(picture.pixels.begin(), picture.pixels.end()), output_);
}

std::vector<float> OnnxModel::operator()(std::span<const float> square, int side) {
  if (square.size() != static_cast<size_t>(side) * static_cast<size_t>(side) * 3) {
    throw std::logic_error("[onnx model] a square that is none, or not of RGB");
  }
  const cv::Mat given(side, side, CV_32FC3, const_cast<float*>(square.data()));
  cv::Mat picture;
  cv::resize(given, picture, {input_.side, input_.side}, 0, 0, cv::INTER_LINEAR);
  return run({picture.ptr<float>(), picture.total() * 3}, output_);
}

}  // namespace degas
