// An OpenCL layer that makes trouble, loaded before the real one by LD_PRELOAD. FAILING_OPENCL says which, separated by
// commas, and FAILING_OPENCL_LOG names a file to which each trouble made is added as a line:
//   clEnqueueNDRangeKernel:N, clSetKernelArg:N, clCreateBuffer:N, clBuildProgram:N, clEnqueueReadBuffer:N, clFinish:N,
//   clEnqueueWriteBuffer:N, clEnqueueCopyBuffer:N, clEnqueueFillBuffer:N
//              from the N-th call of that function on the device is gone: it refuses all of these
//   memory:N   from the N-th buffer on none finds memory
//   squeeze:N  the N-th buffer alone finds none
//   late:N     from the N-th launch on none finds memory, as by drivers that give buffers theirs when they are used
//   build      no program is built
//   gpu        the devices call themselves GPUs
//   small      their work-groups hold 64 items and their local memory 8 KiB; larger work-groups are refused
//   registers  larger work-groups are refused, though the devices say that they hold them
//   no_double  they lack cl_khr_fp64, and build no program that names the type
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <dlfcn.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>

namespace {

/// The number after `name:`, 1 where there is only the name, 0 where it is not asked for.
long asked(const std::string& name) {
  const char* settings = std::getenv("FAILING_OPENCL");
  std::string rest = settings ? settings : "";
  while (!rest.empty()) {
    const std::string word = rest.substr(0, rest.find(','));
    rest = rest.size() > word.size() ? rest.substr(word.size() + 1) : "";
    if (word == name) return 1;
    if (word.rfind(name + ":", 0) == 0) return std::atol(word.c_str() + name.size() + 1);
  }
  return 0;
}

void note(const char* trouble) {
  if (const char* file = std::getenv("FAILING_OPENCL_LOG")) std::ofstream(file, std::ios::app) << trouble << '\n';
}

template <typename Function>
Function* real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}
#define REAL(function) real<decltype(function)>(#function)

std::atomic<bool> lost{false};

/// The calls of one function, one of which may be where the device is lost.
class Calls {
 public:
  explicit Calls(const char* function) : function_(function), fatal_(asked(function)) {}
  /// Counts a call and says whether the device is gone.
  bool refused() {
    if (++count_ == fatal_) {
      note(function_);
      lost = true;
    }
    return lost;
  }

 private:
  const char* function_;
  const long fatal_;
  std::atomic<long> count_{0};
};

std::atomic<long> buffers{0}, launches{0};

constexpr size_t small_group = 64;
constexpr cl_ulong small_local_bytes = 8 << 10;

}  // namespace

extern "C" {

cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint rank, const size_t* offset,
                              const size_t* global, const size_t* local, cl_uint waits, const cl_event* list,
                              cl_event* event) {
  static Calls calls("clEnqueueNDRangeKernel");
  if (calls.refused()) return CL_DEVICE_NOT_AVAILABLE;
  static const bool is_small = asked("small") || asked("registers");
  static const long fails_from = asked("late");
  if (fails_from > 0 && ++launches >= fails_from) {
    note("late");
    return CL_MEM_OBJECT_ALLOCATION_FAILURE;
  }
  size_t items = 1;
  for (cl_uint axis = 0; local && axis < rank; ++axis) items *= local[axis];
  if (is_small && items > small_group) {
    note("group refused");
    return CL_INVALID_WORK_GROUP_SIZE;
  }
  static auto* const launch = REAL(clEnqueueNDRangeKernel);
  return launch(queue, kernel, rank, offset, global, local, waits, list, event);
}

cl_int clSetKernelArg(cl_kernel kernel, cl_uint index, size_t size, const void* value) {
  static Calls calls("clSetKernelArg");
  if (calls.refused()) return CL_INVALID_CONTEXT;
  static auto* const set = REAL(clSetKernelArg);
  return set(kernel, index, size, value);
}

cl_int clEnqueueReadBuffer(cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size,
                           void* target, cl_uint waits, const cl_event* list, cl_event* event) {
  static Calls calls("clEnqueueReadBuffer");
  if (calls.refused()) return CL_INVALID_COMMAND_QUEUE;
  static auto* const read = REAL(clEnqueueReadBuffer);
  return read(queue, buffer, blocking, offset, size, target, waits, list, event);
}

cl_int clEnqueueWriteBuffer(cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size,
                            const void* source, cl_uint waits, const cl_event* list, cl_event* event) {
  static Calls calls("clEnqueueWriteBuffer");
  if (calls.refused()) return CL_INVALID_COMMAND_QUEUE;
  static auto* const write = REAL(clEnqueueWriteBuffer);
  return write(queue, buffer, blocking, offset, size, source, waits, list, event);
}

cl_int clEnqueueCopyBuffer(cl_command_queue queue, cl_mem source, cl_mem target, size_t source_offset,
                           size_t target_offset, size_t size, cl_uint waits, const cl_event* list, cl_event* event) {
  static Calls calls("clEnqueueCopyBuffer");
  if (calls.refused()) return CL_INVALID_COMMAND_QUEUE;
  static auto* const copy = REAL(clEnqueueCopyBuffer);
  return copy(queue, source, target, source_offset, target_offset, size, waits, list, event);
}

cl_int clEnqueueFillBuffer(cl_command_queue queue, cl_mem buffer, const void* pattern, size_t pattern_size,
                           size_t offset, size_t size, cl_uint waits, const cl_event* list, cl_event* event) {
  static Calls calls("clEnqueueFillBuffer");
  if (calls.refused()) return CL_INVALID_COMMAND_QUEUE;
  static auto* const fill = REAL(clEnqueueFillBuffer);
  return fill(queue, buffer, pattern, pattern_size, offset, size, waits, list, event);
}

cl_int clFinish(cl_command_queue queue) {
  static Calls calls("clFinish");
  if (calls.refused()) return CL_DEVICE_NOT_AVAILABLE;
  static auto* const finish = REAL(clFinish);
  return finish(queue);
}

cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void* host, cl_int* status) {
  static const long fails_from = asked("memory"), fails_once = asked("squeeze");
  static Calls calls("clCreateBuffer");
  if (calls.refused()) {
    if (status) *status = CL_INVALID_CONTEXT;
    return nullptr;
  }
  const long number = ++buffers;
  if ((fails_from > 0 && number >= fails_from) || number == fails_once) {
    note("memory");
    if (status) *status = CL_MEM_OBJECT_ALLOCATION_FAILURE;
    return nullptr;
  }
  static auto* const create = REAL(clCreateBuffer);
  return create(context, flags, size, host, status);
}

cl_program clCreateProgramWithSource(cl_context context, cl_uint count, const char** texts, const size_t* lengths,
                                     cl_int* status) {
  static auto* const create = REAL(clCreateProgramWithSource);
  if (!asked("no_double")) return create(context, count, texts, lengths, status);
  // Behind the compiler's own declarations, before all of ours.
  std::string source = "#define double type_that_this_device_lacks\n#line 1\n";
  for (cl_uint i = 0; i < count; ++i)
    source += lengths && lengths[i] ? std::string(texts[i], lengths[i]) : std::string(texts[i]);
  note("source without double");
  const char* text = source.c_str();
  return create(context, 1, &text, nullptr, status);
}

cl_int clBuildProgram(cl_program program, cl_uint count, const cl_device_id* devices, const char* options,
                      void(CL_CALLBACK* notify)(cl_program, void*), void* data) {
  static Calls calls("clBuildProgram");
  if (calls.refused()) return CL_DEVICE_NOT_AVAILABLE;
  if (asked("build")) {
    note("build");
    return CL_BUILD_PROGRAM_FAILURE;
  }
  static auto* const build = REAL(clBuildProgram);
  return build(program, count, devices, options, notify, data);
}

cl_int clGetDeviceInfo(cl_device_id device, cl_device_info key, size_t size, void* value, size_t* needed) {
  static auto* const query = REAL(clGetDeviceInfo);
  const cl_int status = query(device, key, size, value, needed);
  if (status != CL_SUCCESS || !value) return status;
  if (key == CL_DEVICE_TYPE && asked("gpu")) {
    note("gpu");
    *static_cast<cl_device_type*>(value) = CL_DEVICE_TYPE_GPU;
  }
  if (key == CL_DEVICE_MAX_WORK_GROUP_SIZE && asked("small")) {
    note("small");
    *static_cast<size_t*>(value) = small_group;
  }
  if (key == CL_DEVICE_LOCAL_MEM_SIZE && asked("small")) *static_cast<cl_ulong*>(value) = small_local_bytes;
  if (key == CL_DEVICE_EXTENSIONS && asked("no_double")) {
    if (char* found = std::strstr(static_cast<char*>(value), "cl_khr_fp64")) {
      note("no_double");
      std::memset(found, 'x', 11);
    }
  }
  return status;
}

}  // extern "C"
