#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "host/io/npy.h"

namespace degas {

/// Tensors by name; nested dictionaries join their keys by dots, a bare tensor's name is empty.
using TorchTensors = std::map<std::string, NpyArray>;

/// Reads what torch.save wrote (the zip format of PyTorch 1.6 and later): a tensor, or dictionaries of tensors, in
/// which numbers, texts and lists are passed over. The pickle inside is interpreted by a reader that knows plain data
/// and the rebuilding of tensors and runs no code: anything else is an Error naming file and reason.
TorchTensors read_torch_archive(const std::filesystem::path& path);
/// The same from memory; `label` stands for the file in errors.
TorchTensors read_torch_archive(std::vector<std::byte> bytes, const std::string& label);

/// The bytes that torch.load reads as a dictionary of CPU tensors; `name` is the archive's inner folder. Equal tensors
/// give equal bytes. Text arrays are a std::logic_error.
std::vector<std::byte> make_torch_archive(const TorchTensors& tensors, const std::string& name = "archive");

}  // namespace degas
