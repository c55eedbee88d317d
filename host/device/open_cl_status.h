#pragma once

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <string>
#include <string_view>

namespace degas {

/// Whether a call with this status says that the device is gone: reset, switched off or stopped by its driver.
bool means_lost(cl_int status);

/// Throws what the status of an OpenCL call means, unless it is CL_SUCCESS: Error where the device is full, lost or too
/// small for a work-group, std::logic_error where the call was wrong. what: the call, or the kernel it is for;
/// device: its name.
void check_status(cl_int status, std::string_view what, const std::string& device);

}  // namespace degas
