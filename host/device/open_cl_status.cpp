#include "host/device/open_cl_status.h"

#include "host/error.h"

namespace degas {

bool means_lost(cl_int status) {
  constexpr cl_int broken_by_nvidia = -9999;  // an access outside of memory, by its driver
  switch (status) {
    case CL_DEVICE_NOT_AVAILABLE:
    case CL_INVALID_DEVICE:
    case CL_INVALID_CONTEXT:
    case CL_INVALID_COMMAND_QUEUE:
    case CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST:
    case broken_by_nvidia:
      return true;
    default:
      return false;
  }
}

void check_status(cl_int status, std::string_view what, const std::string& device) {
  if (status == CL_SUCCESS) return;
  if (means_lost(status)) {
    throw Error::format(
        "device {}: lost in {} (OpenCL status {}): reset, switched off or stopped by its driver; see the system's log, "
        "then start again: training goes on from its checkpoint with --resume",
        device, what, status);
  }
  switch (status) {
    case CL_OUT_OF_RESOURCES:
      throw Error::format(
          "device {}: out of resources in {} (OpenCL status {}): of memory, then lower net.resolution, net.width or "
          "train.views_per_step; or of registers and local memory, then try --kernels wide",
          device, what, status);
    case CL_MEM_OBJECT_ALLOCATION_FAILURE:
    case CL_OUT_OF_HOST_MEMORY:
      throw Error::format(
          "device out of memory in {} (OpenCL status {}); lower net.resolution, net.width or train.views_per_step",
          what, status);
    case CL_INVALID_WORK_GROUP_SIZE:
      throw Error::format(
          "device {}: too few registers or too little local memory for a work-group of {}; try --kernels wide, or "
          "another --device",
          device, what);
    default:
      throw std::logic_error(fmt::format("[{}] OpenCL status {}", what, status));
  }
}

}  // namespace degas
