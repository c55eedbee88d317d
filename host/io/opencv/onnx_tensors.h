#pragma once

#include <filesystem>

namespace degas {

/// Looks through the tensors of an ONNX file (weights and attributes, of subgraphs too), since OpenCV's reader copies
/// as many numbers as a tensor's dimensions say, whether they are there or not. Error naming the file and the tensor
/// for one that holds another number of numbers, holds them as another type than its own, or in another file; naming
/// the file where it is no protocol buffer. What else a network must be is OpenCV's to tell. File layout:
/// https://onnx.ai/onnx/repo-docs/IR.html, of messages: https://protobuf.dev/programming-guides/encoding/
void check_onnx_tensors(const std::filesystem::path& path);

}  // namespace degas
