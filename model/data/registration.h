#pragma once

#include <filesystem>
#include <memory>

#include "model/data/capture.h"

namespace degas {

/// The capture with the body parameters of a file (read_smplx_parameters) in place of its own: another tracker's, or
/// those that `degas fit-poses` refined. Both identities change with what the file holds. Error naming the file where
/// it does not have the very frames of the capture, by their numbers.
std::unique_ptr<Capture> with_registration(std::unique_ptr<Capture> source, const std::filesystem::path& file,
                                           const std::function<void(const std::string&)>& warn = print_warning);

}  // namespace degas
