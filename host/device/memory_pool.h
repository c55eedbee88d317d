#pragma once

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace degas {

/// Device memory on loan from a MemoryPool; goes back when the last owner lets go. Because all work is on one
/// in-order queue, memory may go back while kernels that use it are still queued: its next user runs after them.
class Memory {
 public:
  Memory(cl_mem handle, size_t bytes) : handle_(handle), bytes_(bytes) {}
  cl_mem handle() const { return handle_; }
  /// Bytes that may be touched: the size asked for, rounded up to the pool's size class (at least 256-byte steps).
  size_t bytes() const { return bytes_; }

 private:
  cl_mem handle_;
  size_t bytes_;
};

/// Recycles device buffers by size class, so that a training step allocates nothing once every size has been seen.
/// Classes: multiples of 256 bytes below 4 KiB, then eight steps to each power of two (at most 12.5 % waste).
class MemoryPool {
 public:
  struct Statistics {
    size_t device_allocations = 0;  ///< clCreateBuffer calls so far
    size_t bytes_held = 0;          ///< on loan + free, all owned from the driver's view
    size_t bytes_in_use = 0;
    size_t peak_bytes_in_use = 0;
  };

  /// device: its name, for messages; largest_buffer: CL_DEVICE_MAX_MEM_ALLOC_SIZE; limit: bytes the pool may hold in
  /// all (0: the driver decides).
  MemoryPool(cl_context context, std::string device, size_t largest_buffer, size_t limit);
  ~MemoryPool();
  MemoryPool(const MemoryPool&) = delete;
  MemoryPool& operator=(const MemoryPool&) = delete;

  /// Throws Error naming the sizes when the device has no room, after giving free buffers back to the driver.
  std::shared_ptr<Memory> acquire(size_t bytes);
  Statistics statistics() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

/// The size class that serves `bytes`.
size_t memory_size_class(size_t bytes);

}  // namespace degas
