#include "host/device/device.h"

#include <deque>
#include <unordered_map>

#include "host/device/open_cl_status.h"
#include "host/device/program.h"
#include "host/device/tuner.h"
#include "host/error.h"

namespace degas {
struct Device::OpenCl {
  cl_device_id device = nullptr;
  cl_context context = nullptr;
  cl_command_queue queue = nullptr;
  std::unordered_map<std::string, cl_program> programs;  // by file and options
  struct Built {
    cl_kernel handle;
    std::string name;  // "file/name"
  };
  std::unordered_map<std::string, Built> kernels;  // by file, options and kernel name
  std::deque<std::pair<cl_event, std::vector<unsigned char>>> uploads;

  /// Frees the staging memory of transfers that are through.
  void retire_uploads(bool all) {
    while (!uploads.empty()) {
      cl_int status = CL_COMPLETE;
      clGetEventInfo(uploads.front().first, CL_EVENT_COMMAND_EXECUTION_STATUS, sizeof(status), &status, nullptr);
      if (!all && status > CL_COMPLETE) return;
      clReleaseEvent(uploads.front().first);
      uploads.pop_front();
    }
  }
  ~OpenCl() {
    if (queue) clFinish(queue);
    retire_uploads(true);
    for (auto& [key, built] : kernels) clReleaseKernel(built.handle);
    for (auto& [key, program] : programs) clReleaseProgram(program);
    if (queue) clReleaseCommandQueue(queue);
    if (context) clReleaseContext(context);
  }
};

Device::Device(const DeviceOptions& options) : options_(options), open_cl_(std::make_unique<OpenCl>()) {
  const FoundDevice found = select_device(options.selector);
  description_ = found.description;
  kernel_set_ = options.kernel_set.value_or(description_.is_cpu || !fits_gpu_set(description_) ? KernelSet::Wide
                                                                                               : KernelSet::Gpu);
  const DeviceFamily own = family_of(description_);
  const DeviceFamily fitting = is_wide() ? (description_.is_cpu ? own : DeviceFamily::WideCpu)
                                         : (description_.is_cpu ? DeviceFamily::OtherGpu : own);
  family_ = options.family.value_or(fitting);
  if (options.real == Real::Double && !description_.has_double) {
    throw Error::format("device {}: has no double precision (cl_khr_fp64)", description_.name);
  }
  open_cl_->device = found.id;
  cl_int status = CL_SUCCESS;
  open_cl_->context = clCreateContext(nullptr, 1, &found.id, nullptr, nullptr, &status);
  check_status(status, "clCreateContext", description_.name);
  open_cl_->queue =
      clCreateCommandQueue(open_cl_->context, found.id, options.profile ? CL_QUEUE_PROFILING_ENABLE : 0, &status);
  check_status(status, "clCreateCommandQueue", description_.name);
  pool_ = std::make_unique<MemoryPool>(open_cl_->context, description_.name, description_.largest_buffer_bytes,
                                       options.memory_limit);
}

Device::~Device() = default;

Kernel Device::kernel(const std::string& file, const std::string& name, const Defines& defines) {
  std::string key = file;
  for (const Define& define : defines) {
    key += " -D";
    key += define.name;
    key += '=';
    key += define.value;
  }
  const std::string kernel_key = key + " " + name;
  if (const auto found = open_cl_->kernels.find(kernel_key); found != open_cl_->kernels.end()) {
    return Kernel(*this, found->second.handle, &found->second.name);
  }
  auto program = open_cl_->programs.find(key);
  if (program == open_cl_->programs.end()) {
    const std::string options = fmt::format(
        "-cl-std=CL1.2 -cl-mad-enable -cl-no-signed-zeros{} -DREAL={} -DREAL_IS_DOUBLE={} -DV={} -DWIDE={}{}",
        options_.flush_denormals ? " -cl-denorms-are-zero" : "", real_bytes() == 8 ? "double" : "float",
        real_bytes() == 8 ? 1 : 0, vector_width(), is_wide() ? 1 : 0, key.substr(file.size()));
    program =
        open_cl_->programs
            .emplace(key, build_program(open_cl_->context, open_cl_->device, file + ".cl", kernel_text(file), options))
            .first;
  }
  cl_int status = CL_SUCCESS;
  cl_kernel handle = clCreateKernel(program->second, name.c_str(), &status);
  check_status(status, fmt::format("clCreateKernel of {}/{}", file, name), description_.name);
  const auto built = open_cl_->kernels.emplace(kernel_key, OpenCl::Built{handle, file + "/" + name}).first;
  return Kernel(*this, handle, &built->second.name);
}

std::string Device::kernel_text(const std::string& file) const {
  return kernel_source(file + ".cl", options_.kernel_folder);
}

void Device::set_tuner(std::unique_ptr<Tuner> tuner) {
  tuner_ = std::move(tuner);
}

template <typename Enqueue>
void Device::profiled(const char* name, const Enqueue& enqueue) {
  cl_event event = nullptr;
  check_status(enqueue(options_.profile ? &event : nullptr), name, description_.name);
  if (event) profiler_.record(stage_, name, event);
}

std::shared_ptr<Memory> Device::allocate(size_t bytes) {
  auto memory = pool_->acquire(bytes);
  if (options_.poison_memory) fill(*memory, 0xFF, memory->bytes());
  return memory;
}

const Memory& Device::zeros(size_t bytes) {
  if (!zeros_ || zeros_->bytes() < bytes) {
    zeros_ = pool_->acquire(bytes);
    fill(*zeros_, 0, zeros_->bytes());
  }
  return *zeros_;
}

void Device::upload(const Memory& target, const void* source, size_t bytes) {
  if (bytes == 0) return;
  open_cl_->retire_uploads(false);
  const auto* begin = static_cast<const unsigned char*>(source);
  auto& [event, staging] = open_cl_->uploads.emplace_back(nullptr, std::vector<unsigned char>(begin, begin + bytes));
  check_status(
      clEnqueueWriteBuffer(open_cl_->queue, target.handle(), CL_FALSE, 0, bytes, staging.data(), 0, nullptr, &event),
      "upload", description_.name);
  if (options_.profile) {
    clRetainEvent(event);
    profiler_.record(stage_, "memory/upload", event);
  }
  clFlush(open_cl_->queue);
}

void Device::download(const Memory& source, void* target, size_t bytes, size_t offset) {
  if (bytes == 0) return;
  check_status(
      clEnqueueReadBuffer(open_cl_->queue, source.handle(), CL_TRUE, offset, bytes, target, 0, nullptr, nullptr),
      "download", description_.name);
}

void Device::copy(const Memory& source, const Memory& target, size_t bytes) {
  if (bytes == 0) return;
  profiled("memory/copy", [&](cl_event* event) {
    return clEnqueueCopyBuffer(open_cl_->queue, source.handle(), target.handle(), 0, 0, bytes, 0, nullptr, event);
  });
}

void Device::fill(const Memory& target, unsigned char value, size_t bytes) {
  if (bytes == 0) return;
  profiled("memory/fill", [&](cl_event* event) {
    return clEnqueueFillBuffer(open_cl_->queue, target.handle(), &value, 1, 0, bytes, 0, nullptr, event);
  });
}

void Device::finish() {
  check_status(clFinish(open_cl_->queue), "finish", description_.name);
}

std::vector<Profiler::Row> Device::take_profile() {
  finish();
  return profiler_.take_rows();
}

void Kernel::set_raw(unsigned index, size_t bytes, const void* value) const {
  const cl_int status = clSetKernelArg(handle_, index, bytes, value);
  if (status == CL_SUCCESS) return;
  check_status(status, fmt::format("argument {} of {} bytes for {}", index, bytes, *name_), device_->description_.name);
}

void Kernel::set_memory(unsigned index, const Memory* memory) const {
  cl_mem handle = memory ? memory->handle() : nullptr;
  set_raw(index, sizeof(handle), &handle);
}

void Kernel::set_argument(unsigned index, double real) const {
  if (device_->real_bytes() == 8) return set_raw(index, sizeof(double), &real);
  const float value = static_cast<float>(real);
  set_raw(index, sizeof(value), &value);
}

void Kernel::enqueue(const Range& global, const Range& local) const {
  if (global.size() != local.size()) throw std::logic_error(fmt::format("[{}] global and local ranks differ", *name_));
  size_t rounded[3] = {1, 1, 1};
  for (size_t axis = 0; axis < global.size(); ++axis) {
    if (global[axis] == 0) return;  // nothing to do is no error
    rounded[axis] = (global[axis] + local[axis] - 1) / local[axis] * local[axis];
  }
  device_->profiled(name_->c_str(), [&](cl_event* event) {
    return clEnqueueNDRangeKernel(device_->open_cl_->queue, handle_, static_cast<cl_uint>(global.size()), nullptr,
                                  rounded, local.data(), 0, nullptr, event);
  });
  ++device_->launches_;
}

}  // namespace degas
