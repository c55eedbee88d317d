#pragma once

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <cstddef>
#include <string>
#include <vector>

namespace degas {

/// What a device says of itself. Sizes in bytes.
struct DeviceDescription {
  int index = 0;  ///< in `degas devices`' order
  std::string name, vendor, platform, version, driver;
  bool is_cpu = false, has_double = false;
  bool local_memory_is_own = false;  ///< else it lies in global memory
  int compute_units = 0;
  int vector_width = 1;  ///< floats in a vector of the hardware
  size_t global_bytes = 0, largest_buffer_bytes = 0, local_bytes = 0, largest_work_group = 0;
};

struct FoundDevice {
  cl_device_id id;
  DeviceDescription description;
};

/// What a device says of itself in words (CL_DEVICE_NAME, ..), without the zero and spaces that end it; "" where it
/// does not answer.
std::string device_text(cl_device_id device, cl_device_info key);

/// Every OpenCL device of the machine, in the platforms' order (empty if there is none).
std::vector<FoundDevice> find_devices();

/// The device with that index, or whose name or platform contains the text in any case; where the selector is empty,
/// the GPU with the most memory that fits_gpu_set, else a CPU, else any. Throws Error when none fits, naming those that
/// exist.
FoundDevice select_device(const std::string& selector);

/// Whether the GPU set's largest work-groups, 16 x 16 pixels with their local memory, run there; less is legal OpenCL.
bool fits_gpu_set(const DeviceDescription& description);

}  // namespace degas
