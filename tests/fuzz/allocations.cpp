#include "tests/fuzz/allocations.h"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <new>

namespace {

// Of the whole program, since operator new is. Memory that was taken before a limit may go while it lives: signed.
std::atomic<bool> is_counting = false, is_exceeded = false;
std::atomic<int64_t> live = 0, peak = 0, limit = 0;

void note_peak(int64_t bytes) {
  int64_t known = peak;
  while (bytes > known && !peak.compare_exchange_weak(known, bytes)) {
  }
}

void* counted(size_t size) {
  if (is_counting) {
    const auto wanted = static_cast<int64_t>(std::min<size_t>(size, std::numeric_limits<int64_t>::max() / 2));
    note_peak(live + wanted);
    if (live + wanted > limit) {
      is_exceeded = true;
      throw std::bad_alloc();
    }
  }
  void* memory = std::malloc(size > 0 ? size : 1);
  if (!memory) throw std::bad_alloc();
  if (is_counting) live += static_cast<int64_t>(malloc_usable_size(memory));
  return memory;
}

void* counted_or_null(size_t size) noexcept {
  try {
    return counted(size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}

void release(void* memory) {
  if (is_counting && memory) live -= static_cast<int64_t>(malloc_usable_size(memory));
  std::free(memory);
}

}  // namespace

void* operator new(size_t size) {
  return counted(size);
}
void* operator new[](size_t size) {
  return counted(size);
}
void* operator new(size_t size, const std::nothrow_t&) noexcept {
  return counted_or_null(size);
}
void* operator new[](size_t size, const std::nothrow_t&) noexcept {
  return counted_or_null(size);
}
void operator delete(void* memory) noexcept {
  release(memory);
}
void operator delete[](void* memory) noexcept {
  release(memory);
}
void operator delete(void* memory, size_t) noexcept {
  release(memory);
}
void operator delete[](void* memory, size_t) noexcept {
  release(memory);
}

namespace degas::test {

AllocationLimit::AllocationLimit(size_t live_bytes) {
  live = peak = 0;
  limit = static_cast<int64_t>(live_bytes);
  is_exceeded = false;
  is_counting = true;
}

AllocationLimit::~AllocationLimit() {
  is_counting = false;
}

size_t AllocationLimit::peak_bytes() const {
  return static_cast<size_t>(peak);
}

bool AllocationLimit::was_exceeded() const {
  return is_exceeded;
}

}  // namespace degas::test
