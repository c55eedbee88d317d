#include "host/device/memory_pool.h"

#include <bit>

#include "host/device/open_cl_status.h"
#include "host/error.h"

namespace degas {

struct MemoryPool::State {
  cl_context context;
  std::string device;
  size_t largest_buffer;
  size_t limit;
  std::map<size_t, std::vector<cl_mem>> free;
  Statistics statistics;

  /// Memory on loan keeps the state alive, and the state the context it must be released to.
  State(cl_context context, std::string device, size_t largest_buffer, size_t limit)
      : context(context), device(std::move(device)), largest_buffer(largest_buffer), limit(limit) {
    clRetainContext(context);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void release_free() {
    for (auto& [bytes, handles] : free) {
      for (cl_mem handle : handles) {
        clReleaseMemObject(handle);
        statistics.bytes_held -= bytes;
      }
    }
    free.clear();
  }
  ~State() {
    release_free();
    clReleaseContext(context);
  }
};

size_t memory_size_class(size_t bytes) {
  constexpr size_t small_step = 256, small_limit = 4096;
  if (bytes <= small_limit) return std::max(small_step, (bytes + small_step - 1) / small_step * small_step);
  const size_t step = std::bit_floor(bytes - 1) / 8;
  return (bytes + step - 1) / step * step;
}

MemoryPool::MemoryPool(cl_context context, std::string device, size_t largest_buffer, size_t limit)
    : state_(std::make_shared<State>(context, std::move(device), largest_buffer, limit)) {}

MemoryPool::~MemoryPool() = default;

std::shared_ptr<Memory> MemoryPool::acquire(size_t bytes) {
  const size_t size = memory_size_class(bytes);
  State& state = *state_;
  cl_mem handle = nullptr;
  if (auto found = state.free.find(size); found != state.free.end() && !found->second.empty()) {
    handle = found->second.back();
    found->second.pop_back();
  } else {
    if (size > state.largest_buffer) {
      throw Error::format(
          "device out of memory: one buffer of {} MiB was asked for, {} allows {} MiB; lower net.resolution, net.width "
          "or train.views_per_step",
          size >> 20, state.device, state.largest_buffer >> 20);
    }
    const auto over_limit = [&] { return state.limit && state.statistics.bytes_held + size > state.limit; };
    cl_int status = CL_MEM_OBJECT_ALLOCATION_FAILURE;
    for (int attempt = 0; attempt < 2 && !handle; ++attempt) {
      if (attempt) state.release_free();
      if (over_limit()) continue;
      handle = clCreateBuffer(state.context, CL_MEM_READ_WRITE, size, nullptr, &status);
      if (means_lost(status)) check_status(status, "clCreateBuffer", state.device);
      if (status != CL_SUCCESS) handle = nullptr;
    }
    if (!handle) {
      throw Error::format(
          "device out of memory: {} MiB asked for, {} MiB in use on {} ({}); lower net.resolution, net.width or "
          "train.views_per_step, or {}",
          (size >> 20) + 1, state.statistics.bytes_in_use >> 20, state.device,
          over_limit() ? fmt::format("--memory-limit {} MiB", state.limit >> 20)
                       : fmt::format("OpenCL status {}", status),
          over_limit() ? "raise the limit" : "choose another --device");
    }
    ++state.statistics.device_allocations;
    state.statistics.bytes_held += size;
  }
  state.statistics.bytes_in_use += size;
  state.statistics.peak_bytes_in_use = std::max(state.statistics.peak_bytes_in_use, state.statistics.bytes_in_use);
  return std::shared_ptr<Memory>(new Memory(handle, size), [owner = state_](Memory* memory) {
    owner->free[memory->bytes()].push_back(memory->handle());
    owner->statistics.bytes_in_use -= memory->bytes();
    delete memory;
  });
}

MemoryPool::Statistics MemoryPool::statistics() const {
  return state_->statistics;
}

}  // namespace degas
