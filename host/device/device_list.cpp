#include "host/device/device_list.h"

#include <algorithm>
#include <cctype>

#include "host/error.h"

namespace degas {
namespace {

template <typename Value>
Value device_value(cl_device_id device, cl_device_info key) {
  Value value{};
  clGetDeviceInfo(device, key, sizeof(value), &value, nullptr);
  return value;
}

template <typename Query>
std::string text_of(Query query) {
  size_t bytes = 0;
  query(0, nullptr, &bytes);
  std::string text(bytes, '\0');
  query(bytes, text.data(), nullptr);
  while (!text.empty() && (text.back() == '\0' || text.back() == ' ')) text.pop_back();
  return text;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

}  // namespace

std::string device_text(cl_device_id device, cl_device_info key) {
  return text_of([&](size_t n, void* data, size_t* needed) { clGetDeviceInfo(device, key, n, data, needed); });
}

std::vector<FoundDevice> find_devices() {
  cl_uint platform_count = 0;
  if (clGetPlatformIDs(0, nullptr, &platform_count) != CL_SUCCESS) return {};
  std::vector<cl_platform_id> platforms(platform_count);
  clGetPlatformIDs(platform_count, platforms.data(), nullptr);
  std::vector<FoundDevice> found;
  for (cl_platform_id platform : platforms) {
    cl_uint count = 0;
    if (clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 0, nullptr, &count) != CL_SUCCESS) continue;
    std::vector<cl_device_id> ids(count);
    clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, count, ids.data(), nullptr);
    for (cl_device_id id : ids) {
      DeviceDescription d;
      d.index = static_cast<int>(found.size());
      d.name = device_text(id, CL_DEVICE_NAME);
      d.vendor = device_text(id, CL_DEVICE_VENDOR);
      d.platform = text_of([&](size_t n, void* data, size_t* needed) {
        clGetPlatformInfo(platform, CL_PLATFORM_NAME, n, data, needed);
      });
      d.version = device_text(id, CL_DEVICE_VERSION);
      d.driver = device_text(id, CL_DRIVER_VERSION);
      d.is_cpu = device_value<cl_device_type>(id, CL_DEVICE_TYPE) & CL_DEVICE_TYPE_CPU;
      d.has_double = device_text(id, CL_DEVICE_EXTENSIONS).find("cl_khr_fp64") != std::string::npos;
      d.local_memory_is_own = device_value<cl_device_local_mem_type>(id, CL_DEVICE_LOCAL_MEM_TYPE) == CL_LOCAL;
      d.vector_width = static_cast<int>(device_value<cl_uint>(id, CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT));
      d.compute_units = static_cast<int>(device_value<cl_uint>(id, CL_DEVICE_MAX_COMPUTE_UNITS));
      d.global_bytes = device_value<cl_ulong>(id, CL_DEVICE_GLOBAL_MEM_SIZE);
      d.largest_buffer_bytes = device_value<cl_ulong>(id, CL_DEVICE_MAX_MEM_ALLOC_SIZE);
      d.local_bytes = device_value<cl_ulong>(id, CL_DEVICE_LOCAL_MEM_SIZE);
      d.largest_work_group = device_value<size_t>(id, CL_DEVICE_MAX_WORK_GROUP_SIZE);
      found.push_back({id, d});
    }
  }
  return found;
}

bool fits_gpu_set(const DeviceDescription& description) {
  constexpr size_t largest_group = 256, most_local_bytes = size_t{32} << 10;
  return description.largest_work_group >= largest_group && description.local_bytes >= most_local_bytes;
}

FoundDevice select_device(const std::string& selector) {
  const std::vector<FoundDevice> devices = find_devices();
  if (devices.empty()) {
    throw Error("no OpenCL device on this machine; install a driver, or PoCL for the CPU (Debian: pocl-opencl-icd)");
  }
  if (selector.empty()) {
    return *std::max_element(devices.begin(), devices.end(), [](const FoundDevice& a, const FoundDevice& b) {
      // A GPU that must run the CPU's kernels is slower than a CPU.
      const auto rank = [](const FoundDevice& f) -> size_t {
        if (f.description.is_cpu) return 1;
        return fits_gpu_set(f.description) ? f.description.global_bytes : 0;
      };
      return rank(a) < rank(b);
    });
  }
  std::string names;
  for (const FoundDevice& candidate : devices) {
    const DeviceDescription& d = candidate.description;
    if (selector == std::to_string(d.index)) return candidate;
    if (lower(d.name + " " + d.platform).find(lower(selector)) != std::string::npos) return candidate;
    names += fmt::format(" [{}] {} ({})", d.index, d.name, d.platform);
  }
  throw Error::format("--device {}: no such device; devices here:{}", selector, names);
}

}  // namespace degas
