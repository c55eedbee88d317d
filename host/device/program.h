#pragma once

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <filesystem>
#include <map>
#include <string>

namespace degas {

/// Every file of kernels/ by its path relative to that folder ("conv2d.cl", "common/real.cl"); written by the build.
const std::map<std::string, std::string>& embedded_kernels();

/// The text of a kernel file with its #include "..." lines replaced by the files they name (each once).
/// folder: reads from there instead of the embedded copy, for editing kernels live; empty: embedded.
/// Throws Error naming a file that does not exist.
std::string kernel_source(const std::string& file, const std::filesystem::path& folder);

/// Builds a program, through the binary cache (user_cache.h): keyed by source, options, device and driver, so a change
/// of any of them misses. A binary the driver refuses is rebuilt from source. Throws Error with the first
/// complaint of the build log, which is kept beside the cache.
cl_program build_program(cl_context context, cl_device_id device, const std::string& name, const std::string& source,
                         const std::string& options);

}  // namespace degas
